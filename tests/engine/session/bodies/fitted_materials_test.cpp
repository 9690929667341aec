// Fitted materials do not shake, in any scene: samples, live edits, and unusual bodies.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "engine/scene/samples/samples.h"
#include "engine/spacetime/material.h"
#include "tests/engine/session/bodies/session_support.h"
#include "tests/support/published.h"

namespace limber::session {
namespace {

using scene::MaterialVariables;
using test::bent_bar;
using test::held;
using test::kMaxHighFrequencyShare;
using test::Live;

double body_size(const scene::Scene& scene) {
  return (scene.mesh.nodes.rowwise().maxCoeff() - scene.mesh.nodes.rowwise().minCoeff()).maxCoeff();
}

/// Largest distance that a node goes from one frame to the next [scene units].
double largest_step(const BodySession& session, const BodyResult& result) {
  const Eigen::MatrixXd positions =
      session.positions(result, 0, static_cast<int>(result.modal.cols()));
  double largest = 0;
  for (Eigen::Index i = 0; i + 1 < positions.cols(); ++i) {
    const Eigen::VectorXd step = positions.col(i + 1) - positions.col(i);
    largest = std::max(largest, step.reshaped(3, step.size() / 3).colwise().norm().maxCoeff());
  }
  return largest;
}

double highest_frequency(const spacetime::Material& material) {
  return spacetime::frequency_of(material.dynamics.stiffness.maxCoeff());
}

scene::Scene with_fit(scene::Scene scene, MaterialVariables variables = MaterialVariables::kAll) {
  scene.material_optimisation.variables = variables;
  return scene;
}

/// Of every revision: what is published after the motion of forces alone (or of the material of
/// before) is no higher than that.
void expect_nothing_above_its_start(const std::vector<std::shared_ptr<const BodyResult>>& results) {
  double start = std::numeric_limits<double>::infinity();
  for (const auto& result : results) {
    if (result->material_iterations == 0) {
      start = result->report.total_energy;
    } else {
      EXPECT_LE(result->report.total_energy, start) << "sequence " << result->sequence;
    }
  }
}

/// A session with the motion of forces alone, which comes first, and the fitted one.
struct Fit {
  explicit Fit(const scene::Scene& scene) : live(scene) {
    after = live.recorder->wait_final(0);
    for (const auto& result : live.recorder->results()) {
      if (result->material_iterations == 0) before = result;
    }
  }

  void expect_quiet() const {
    ASSERT_TRUE(before && after && after->material_iterations > 0);
    ASSERT_TRUE(after->high_frequency_share);
    EXPECT_LE(*after->high_frequency_share, kMaxHighFrequencyShare);
    EXPECT_LE(largest_step(live.session, *after), 1.6 * largest_step(live.session, *before));
    EXPECT_LT(after->report.total_energy, before->report.total_energy);
    EXPECT_LE(highest_frequency(*after->material), 0.125 * (1 + 1e-9));
    expect_nothing_above_its_start(live.recorder->results());
  }

  Live live;
  std::shared_ptr<const BodyResult> before, after;
};

/// A sample with a model that is built in a moment.
scene::Scene small_sample(const std::string& name) {
  scene::Scene scene = scene::make_sample(name);
  // Of dino all modes that a user gets: with fewer it does not shake.
  scene.model.mode_count = name == "dino" ? 30 : 20;
  scene.model.candidate_modes = name == "dino" ? 80 : 40;
  scene.model.basis_size = 40;
  scene.model.cubature_size = 16;
  scene.model.basis = scene::Basis::kSnapshots;
  return scene;
}

void expect_quiet_sample(const std::string& name) {
  Fit(with_fit(small_sample(name))).expect_quiet();
}

TEST(FittedMaterials, DinoStaysQuiet) { expect_quiet_sample("dino"); }
TEST(FittedMaterials, FlowerStaysQuiet) { expect_quiet_sample("flower"); }
TEST(FittedMaterials, BirdStaysQuiet) { expect_quiet_sample("bird"); }
TEST(FittedMaterials, BeamStaysQuiet) { expect_quiet_sample("beam"); }

TEST(FittedMaterials, WithoutBoundAndSlowStartDinoShakes) {
  scene::Scene scene = with_fit(small_sample("dino"));
  scene.dynamics = testing::published_dynamics(scene.dynamics.period_frames);
  scene.material_optimisation.max_frequency_hz = 0.5 * scene.dynamics.frames_per_second;
  scene.material_optimisation.slow_steps = 0;
  Live live(scene);
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final && final->high_frequency_share);
  EXPECT_GT(*final->high_frequency_share, 0.1);
  EXPECT_LE(*final->high_frequency_share, 1);
}

TEST(FittedMaterials, DinoStaysQuietWithFrequenciesAndDampingAlone) {
  Fit(with_fit(small_sample("dino"), MaterialVariables::kDynamics)).expect_quiet();
}

TEST(FittedMaterials, DinoStaysQuietWithItsLastEndFree) {
  scene::Scene scene = with_fit(small_sample("dino"));
  scene.last_end = scene::End::kFree;
  Fit(scene).expect_quiet();
}

/// A material that was fitted to other targets is no reason to throw the body about.
TEST(FittedMaterials, LaterEditsOfABodyWithBothEndsFreeDoNotThrowItAbout) {
  scene::Scene scene = small_sample("flower");
  scene.first_end = scene.last_end = scene::End::kFree;
  Live fitted(with_fit(scene)), plain(scene);
  ASSERT_TRUE(fitted.recorder->wait_final(0) && plain.recorder->wait_final(0));
  const std::vector<Eigen::Vector3d> moves = {{0, 0.02, 0}, {0, 0, 0.05}, {0.05, 0, 0}};
  for (std::size_t i = 0; i < moves.size(); ++i) {
    scene::Constraint target = fitted.session.constraints().at(7 - i);
    target.target += moves[i];
    double steps[2] = {};
    for (Live* live : {&fitted, &plain}) {
      const auto receipt = live->session.edit({MoveConstraint{target.id, target.target}});
      const auto final = live->recorder->wait_final(receipt.revision);
      ASSERT_TRUE(final);
      steps[live == &plain] = largest_step(live->session, *final);
    }
    // 1.5 times what forces alone do, which goes farther where they count as in a fit.
    EXPECT_LE(steps[0], 2.5 * steps[1]) << "edit " << i;
  }
}

TEST(FittedMaterials, EightMovesOfATargetStayQuiet) {
  const scene::Scene scene = with_fit(small_sample("flower"));
  Live live(scene);
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::Constraint target = live.session.constraints()[7];
  for (int i = 0; i < 8; ++i) {
    const double angle = 2.4 * i;
    const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), std::cos(3 * angle));
    target.target += 0.05 * body_size(scene) * direction.normalized();
    const auto result = live.edit({MoveConstraint{target.id, target.target}});
    ASSERT_TRUE(result && result->high_frequency_share) << i;
    EXPECT_LE(*result->high_frequency_share, kMaxHighFrequencyShare) << i;
    EXPECT_LE(highest_frequency(*result->material), 0.125 * (1 + 1e-9)) << i;
  }
  expect_nothing_above_its_start(live.recorder->results());
}

TEST(FittedMaterials, ExactConstraintsStayExactAndQuiet) {
  scene::Scene scene = with_fit(small_sample("bird"));
  for (auto& constraint : scene.constraints) constraint.weight = test::kInfinity;
  const Fit fit(scene);
  fit.expect_quiet();
  EXPECT_LT(fit.after->report.max_exact_error, 1e-8);
}

TEST(FittedMaterials, KeyframesStayQuiet) {
  scene::Scene scene = with_fit(small_sample("beam"));
  Live poses(with_fit(scene, MaterialVariables::kMotion));
  const auto swing = poses.recorder->wait_final(0);
  ASSERT_TRUE(swing);
  scene.constraints.clear();
  for (const int quarter : {1, 2, 3}) {
    scene::Keyframe keyframe;
    keyframe.frame = quarter * scene.frame_count / 4;
    const Eigen::VectorXd pose = poses.session.positions(*swing, keyframe.frame, 1).col(0) -
                                 poses.session.geometry()->rest.reshaped();
    keyframe.pose = std::make_shared<const Eigen::VectorXd>((quarter % 2 == 0 ? -1 : 1.5) * pose);
    scene.keyframes.push_back(keyframe);
  }
  Fit(scene).expect_quiet();
}

TEST(FittedMaterials, ABaseMotionStaysQuiet) {
  scene::Scene scene = with_fit(bent_bar());
  scene.frame_count = 60;
  const Eigen::Index nodes = scene.mesh.node_count();
  scene.base_motion.setZero(3 * nodes, scene.frame_count);
  for (int frame = 0; frame < scene.frame_count; ++frame) {
    const double angle = 0.4 * std::sin(2 * std::numbers::pi * frame / 60.0);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix();
    scene.base_motion.col(frame) = (turn * scene.mesh.nodes - scene.mesh.nodes).reshaped();
  }
  Fit(scene).expect_quiet();
}

TEST(FittedMaterials, AFreeBodyStaysQuietAndKeepsItsRigidMotions) {
  scene::Scene scene = with_fit(small_sample("bird"));
  scene.fixed_nodes.clear();
  const Fit fit(scene);
  fit.expect_quiet();
  EXPECT_TRUE(fit.after->material->dynamics.stiffness.head(6).isZero(0));
  EXPECT_TRUE(fit.after->material->mixing.topLeftCorner(6, 6).isIdentity(0));
}

/// Two bars that share an edge only: nothing but the edge holds the second one.
scene::Scene hinged_bars() {
  scene::Scene scene = test::bar(2, 80);
  const Eigen::Index n = scene.mesh.nodes.cols(), m = scene.mesh.tets.cols();
  scene.mesh.nodes.conservativeResize(3, 2 * n);
  scene.mesh.nodes.rightCols(n) =
      scene.mesh.nodes.leftCols(n).colwise() + Eigen::Vector3d(0.2, 0.1, 0);
  scene.mesh.tets.conservativeResize(4, 2 * m);
  scene.mesh.tets.rightCols(m) = scene.mesh.tets.leftCols(m).array() + static_cast<int>(n);
  scene.merge_tolerance = 1e-6;
  const int tip = static_cast<int>(n) + test::bar_node(2, 2, 1, 2);
  scene.constraints = {held(25, tip, {0, 0.05, 0.02}), held(50, tip, {0.02, -0.05, 0.02})};
  return scene;
}

TEST(FittedMaterials, AMechanismStaysQuietAndDoesNotSetTheSlowStart) {
  Live live(with_fit(hinged_bars()));
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final && final->high_frequency_share);
  ASSERT_GT(live.session.model()->mechanism_count, 0);
  EXPECT_LE(*final->high_frequency_share, kMaxHighFrequencyShare);
  EXPECT_LE(highest_frequency(*final->material), 0.125 * (1 + 1e-9));
  // Fitted: a slow start at the mechanism's frequency of about 0 would leave it no modes to move.
  EXPECT_LT(final->report.total_energy, live.recorder->results().front()->report.total_energy);
  expect_nothing_above_its_start(live.recorder->results());
}

TEST(FittedMaterials, ARequestedMotionThatIsFastIsAllowedByTheOption) {
  scene::Scene scene = with_fit(bent_bar());
  scene.frame_count = 60;
  scene.constraints.clear();
  for (int frame = 20; frame < 40; frame += 2)  // a swing of four frames
    scene.constraints.push_back(held(frame, test::kTip, {0, frame % 4 == 0 ? 0.05 : -0.05, 0}));
  scene.material_optimisation.max_frequency_hz = 0.3 * scene.dynamics.frames_per_second;
  Live live(scene);
  const auto free = live.recorder->wait_final(0);
  ASSERT_TRUE(free);
  EXPECT_GT(highest_frequency(*free->material), 0.125);
  EXPECT_LE(highest_frequency(*free->material), 0.3 * (1 + 1e-9));
}

TEST(FittedMaterials, EditsDuringTheSlowStartDoNotBeginItAnew) {
  Live live(with_fit(small_sample("flower")));
  const scene::Constraint target = live.session.constraints()[0];
  for (int i = 1; i <= 20; ++i) {
    live.session.edit({MoveConstraint{target.id, target.target + Eigen::Vector3d(0, 0, 1e-4 * i)}});
  }
  const auto final = live.recorder->wait_final(20);
  ASSERT_TRUE(final && final->high_frequency_share);
  EXPECT_LE(*final->high_frequency_share, kMaxHighFrequencyShare);
  EXPECT_FALSE(final->material == final->initial_material);
  expect_nothing_above_its_start(live.recorder->results());
}

TEST(FittedMaterials, ALowerFrameRateTakesTheHighestFrequencyAlong) {
  scene::Scene scene = with_fit(bent_bar());
  scene.material_optimisation.max_frequency_hz = 10;
  Live live(scene);
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::Dynamics dynamics = live.session.dynamics();
  dynamics.frames_per_second = 15;
  ASSERT_TRUE(live.edit({SetDynamics{testing::requested(dynamics)}}));
  EXPECT_EQ(live.session.scene().material_optimisation.max_frequency_hz, 7.5);
}

}  // namespace
}  // namespace limber::session
