// Motions are calm by default: they neither shake nor swing to the other side, and do not depend on
// the frame rate. On all bodies: limber-bench calm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "engine/session/bodies/motion_check.h"
#include "tests/engine/session/bodies/session_support.h"
#include "tests/support/published.h"

namespace limber::session {
namespace {

using test::held;
using test::kTip;
using test::Live;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kPeriod = 4.0 / 3;  // [s]

/// Five seconds of a bar with one key of a third of its length in the middle.
scene::Scene keyed_bar(int rate, bool is_exact) {
  scene::Scene scene = test::bar(test::kCells, 5 * rate + 1);
  scene.dynamics.frames_per_second = rate;
  scene.dynamics.period_frames = kPeriod * rate;
  scene.constraints = {held(5 * rate / 2, kTip, {0, 0.12, 0.06})};
  if (is_exact) scene.constraints[0].weight = std::numeric_limits<double>::infinity();
  return scene;
}

/// Displacement of the tip along its key, over the key, in each frame.
Eigen::RowVectorXd along_key(const Live& live, const BodyResult& result) {
  const scene::Scene scene = live.session.scene();
  const Eigen::MatrixXd positions = live.session.positions(result, 0, scene.frame_count);
  const Eigen::Matrix3Xd moved =
      positions.middleRows<3>(3 * kTip).colwise() - scene.mesh.nodes.col(kTip);
  const Eigen::Vector3d key = scene.constraints[0].target;
  return key.transpose() / key.squaredNorm() * moved;
}

std::shared_ptr<const BodyResult> checked(Live& live, Revision revision = 0) {
  EXPECT_TRUE(live.recorder->wait_final(revision));
  return live.recorder->wait_checked(revision);
}

TEST(SessionCalm, OneKeyNeitherShakesNorSwingsToTheOtherSide) {
  for (const bool is_exact : {false, true}) {
    Live live(keyed_bar(24, is_exact));
    const auto result = checked(live);
    ASSERT_TRUE(result && result->motion_check);
    EXPECT_LT(result->motion_check->shaking.zigzag, kMaxZigzag * result->motion_check->length);
    EXPECT_LT(result->high_frequency_share.value(), kMaxHighFrequencyShare);
    EXPECT_THAT(result->report.message, Not(HasSubstr("shakes")));
    EXPECT_GT(along_key(live, *result).minCoeff(), -0.01);
  }
}

TEST(SessionCalm, WhatIsShownShakesAsMuchAsIsSaid) {
  scene::Scene scene = keyed_bar(24, true);
  scene.dynamics = testing::published_dynamics(kPeriod * 24);
  // Much in few frames.
  scene.constraints.push_back(held(62, kTip, {0, -0.12, 0.1}));
  Live live(scene);
  const auto result = checked(live);
  ASSERT_TRUE(result && result->motion_check);
  const MotionCheck& check = *result->motion_check;
  const Eigen::MatrixXd shown = live.session.positions(*result, 0, scene.frame_count);
  double zigzag = 0;
  int frame = 0;
  for (int i = 1; i + 1 < scene.frame_count; ++i) {
    const Eigen::VectorXd apart = shown.col(i) - 0.5 * (shown.col(i - 1) + shown.col(i + 1));
    const double most = apart.reshaped(3, apart.size() / 3).colwise().norm().maxCoeff();
    if (most > zigzag) zigzag = most, frame = i;
  }
  EXPECT_GT(zigzag, kMaxZigzag * check.length);
  EXPECT_NEAR(check.shaking.zigzag, zigzag, 1e-5 * zigzag);
  EXPECT_EQ(check.shaking.frame, frame);
  EXPECT_THAT(result->report.message, HasSubstr("The motion shakes: in frame"));
}

TEST(SessionCalm, TheFrameRateChangesNothingInSeconds) {
  for (const bool is_exact : {false, true}) {
    Live slow(keyed_bar(24, is_exact)), fast(keyed_bar(48, is_exact));
    const auto at_24 = checked(slow), at_48 = checked(fast);
    ASSERT_TRUE(at_24 && at_48);
    const Eigen::RowVectorXd curve_24 = along_key(slow, *at_24), curve_48 = along_key(fast, *at_48);
    double most = 0;
    for (Eigen::Index i = 0; i < curve_24.size(); ++i)
      most = std::max(most, std::abs(curve_24[i] - curve_48[2 * i]));
    EXPECT_LT(most, 0.01);
    // A soft weight means the same.
    EXPECT_NEAR(at_24->report.constraint_energy, at_48->report.constraint_energy,
                0.02 * at_48->report.constraint_energy + 1e-12);
  }
}

TEST(SessionCalm, TwoEqualKeysHoldTheBodyBetweenThem) {
  scene::Scene scene = keyed_bar(24, true);
  scene.constraints[0].frame = 40;
  scene.constraints.push_back(scene.constraints[0]);
  scene.constraints[1].frame = 72;  // a swing later
  Live live(scene);
  const auto result = checked(live);
  ASSERT_TRUE(result);
  const Eigen::RowVectorXd between = along_key(live, *result).segment(40, 33);
  EXPECT_GT(between.minCoeff(), 0.5);
  EXPECT_LT(between.maxCoeff(), 1.1);
}

TEST(SessionCalm, NeighbouringExactKeysThatThrowTheBodyAreNamed) {
  scene::Scene scene = keyed_bar(24, true);
  scene.constraints[0].frame = 60;
  scene.model.mode_count = 3;  // more would bend it in between
  scene.constraints.push_back(held(61, test::bar_node(test::kCells, 2, 1, 1), {0, -0.12, 0}));
  scene.constraints[1].weight = scene.constraints[0].weight;
  Live live(scene);
  const auto thrown = checked(live);
  ASSERT_TRUE(thrown && thrown->motion_check);
  EXPECT_GT(thrown->motion_check->thrown.distance, thrown->motion_check->length);
  EXPECT_THAT(thrown->report.message, HasSubstr("exact targets in frames 60 and 61"));
  scene.constraints[1].frame = 100;
  Live slower(scene);
  const auto result = checked(slower);
  ASSERT_TRUE(result);
  EXPECT_THAT(result->report.message, Not(HasSubstr("thrown")));
}

/// Forces count as displacements while nothing is fitted, and by themselves from a fit on.
TEST(SessionCalm, UndoOfAFitComesBackToForcesThatCountAsDisplacements) {
  Live live(keyed_bar(24, false));
  const auto first = checked(live);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->material->dynamics.shares.size(), first->material->dynamics.stiffness.size());
  const auto fitted = live.edit({SetMaterialVariables{scene::MaterialVariables::kDynamics}});
  EXPECT_EQ(fitted->material->dynamics.shares.size(), 0);
  const auto back = live.edit({Undo{}});
  EXPECT_EQ(back->material, back->initial_material) << "nothing is fitted";
  EXPECT_EQ(back->material->dynamics.shares, first->material->dynamics.shares);
  scene::DynamicsRequest smoother{24, kPeriod * 24, 0.7, {}, 0.8};
  const auto smooth = live.edit({SetDynamics{smoother}});
  EXPECT_EQ(smooth->material->dynamics.shares, first->material->dynamics.shares);
  const auto again = live.edit({SetMaterialVariables{scene::MaterialVariables::kDynamics}});
  EXPECT_EQ(again->material->dynamics.shares.size(), 0);
  const auto frozen = live.edit({SetMaterialVariables{scene::MaterialVariables::kMotion}});
  EXPECT_EQ(frozen->material->dynamics.stiffness, again->material->dynamics.stiffness);
  EXPECT_EQ(frozen->material->dynamics.shares.size(), 0);
  const auto reset = live.edit({ResetMaterial{}});
  EXPECT_EQ(reset->material->dynamics.shares, first->material->dynamics.shares);
}

TEST(SessionCalm, LivelierMotionsSwingOn) {
  Live live(keyed_bar(24, true));
  const auto calm = checked(live);
  ASSERT_TRUE(calm);
  scene::Dynamics lively = live.session.dynamics();
  lively.damping_ratio = 0.02;
  lively.force_smoothing = 0.05;
  const auto swung = live.edit({SetDynamics{testing::requested(lively)}});
  ASSERT_TRUE(swung);
  EXPECT_LT(along_key(live, *swung).minCoeff(), -0.1);
  const auto fresh = test::solve_fresh(live.session.scene(), test::shared_cache());
  EXPECT_NEAR(swung->report.total_energy, fresh->report.total_energy,
              1e-6 * fresh->report.total_energy);
  const auto again = live.edit({Undo{}});
  ASSERT_TRUE(again);
  EXPECT_LT((along_key(live, *again) - along_key(live, *calm)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(SessionCalm, AnEditWithoutADiscretisationKeepsTheSessions) {
  for (const scene::Discretisation form :
       {scene::Discretisation::kSampled, scene::Discretisation::kDifferences}) {
    scene::Scene scene = keyed_bar(24, false);
    scene.dynamics.discretisation = form;
    Live live(scene);
    ASSERT_TRUE(live.edit({SetDynamics{{24, 30}}}));
    const scene::Dynamics dynamics = live.session.dynamics();
    EXPECT_EQ(dynamics.discretisation, form);
    const bool is_calm = form == scene::Discretisation::kSampled;
    EXPECT_EQ(dynamics.damping_ratio, is_calm ? scene::Dynamics::kCalmDamping : 0);
    EXPECT_EQ(dynamics.force_smoothing, is_calm ? scene::Dynamics::kCalmSmoothing : 0);
  }
}

TEST(SessionCalm, OtherCostsOfForcesLeaveAFittedMaterial) {
  scene::Scene scene = test::bent_bar();
  scene.material_optimisation.variables = scene::MaterialVariables::kDynamics;
  Live live(scene);
  const auto fitted = live.recorder->wait_final(0);
  ASSERT_TRUE(fitted && fitted->material_iterations > 0);
  live.edit({SetMaterialVariables{scene::MaterialVariables::kMotion}});
  scene::Dynamics smoother = live.session.dynamics();
  smoother.force_smoothing *= 1.5;
  const auto result = live.edit({SetDynamics{testing::requested(smoother)}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->material->dynamics.stiffness, fitted->material->dynamics.stiffness);
  EXPECT_NEAR(result->material->dynamics.smoothing, 1.5 * fitted->material->dynamics.smoothing,
              1e-12);
  EXPECT_NEAR(result->initial_material->dynamics.smoothing,
              1.5 * fitted->material->dynamics.smoothing, 1e-12);
}

}  // namespace
}  // namespace limber::session
