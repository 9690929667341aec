// Constraints on velocities, from the scene to the frames that a client gets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/engine/session/bodies/session_support.h"
#include "tests/support/published.h"

namespace limber::session {
namespace {

using scene::End;
using spacetime::SolveStatus;
using test::bent_bar;
using test::held;
using test::kInfinity;
using test::kTip;
using test::Live;
using test::tip_at;

scene::Constraint velocity(int frame, const Eigen::Vector3d& target, double weight = kInfinity) {
  scene::Constraint constraint = held(frame, kTip, target);
  constraint.kind = scene::TargetKind::kVelocity;
  constraint.weight = weight;
  return constraint;
}

/// Of the shown frames [length unit / s].
Eigen::Vector3d shown_velocity(const Live& live, const BodyResult& result, int since, int until,
                               double frames_per_second) {
  return (tip_at(live.session, result, until) - tip_at(live.session, result, since)) /
         (until - since) * frames_per_second;
}

constexpr double kSinglePrecision = 2e-5;  // of differences of frames, as velocities a second

TEST(SessionVelocities, ExactOnesAreThoseOfTheShownFrames) {
  Live live(bent_bar());
  const Eigen::Vector3d target(0.05, 0.9, -0.4);
  const auto result = live.edit({AddConstraint{velocity(15, target)}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  EXPECT_LT((shown_velocity(live, *result, 14, 16, 30) - target).norm(), kSinglePrecision);
  EXPECT_LT(result->report.max_exact_velocity_error, 1e-8);
  EXPECT_EQ(result->report.max_exact_error, 0);
  EXPECT_EQ(result->frames_per_second, 30);
}

TEST(SessionVelocities, SoftOnesPullHarderWithTheirWeight) {
  Live live(bent_bar());
  const Eigen::Vector3d target(0, 2, 0);
  double before = 1e9;
  for (const double weight : {0.1, 10.0, 1e4}) {
    const auto result =
        weight == 0.1 ? live.edit({AddConstraint{velocity(6, target, weight)}}) : live.edit({[&] {
          scene::Constraint again = velocity(6, target, weight);
          again.id = 3;
          return ReplaceConstraint{again};
        }()});
    const double missed = (shown_velocity(live, *result, 5, 7, 30) - target).norm();
    EXPECT_NEAR(result->report.max_velocity_error * 30, missed, kSinglePrecision);
    EXPECT_LT(missed, before);
    before = missed;
  }
  EXPECT_LT(before, 0.05);
}

/// One gamma a second: the energy that a result reports.
TEST(SessionVelocities, TheUnitOfASoftOneIsTheSecond) {
  scene::Scene scene = bent_bar();
  scene.constraints = {velocity(15, {0, 1, 0}, 0.005)};
  scene.constraints[0].axes = 2;
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  const double missed =
      (1 - shown_velocity(live, *result, 14, 16, 30).y()) / live.session.model()->length;
  EXPECT_GT(missed, 1e-3);
  EXPECT_NEAR(result->report.constraint_energy, 0.0025 * missed * missed, 1e-6 * missed * missed);
}

TEST(SessionVelocities, AtFreeEndsAreOneSided) {
  scene::Scene scene = bent_bar();
  scene.first_end = scene.last_end = End::kFree;
  const Eigen::Vector3d first(0, 0.3, 0.2), last(0, -0.6, 0.1);
  scene.constraints.push_back(velocity(0, first));
  scene.constraints.push_back(velocity(29, last));
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  EXPECT_LT((shown_velocity(live, *result, 0, 1, 30) - first).norm(), kSinglePrecision);
  EXPECT_LT((shown_velocity(live, *result, 28, 29, 30) - last).norm(), kSinglePrecision);
}

TEST(SessionVelocities, BesideAHeldEndReadTheFreeFrameAlone) {
  scene::Scene scene = bent_bar();
  scene.last_end = End::kPinnedPosition;
  Live live(scene);
  const Eigen::Vector3d target(0, 0.2, 0.1);
  const auto result =
      live.edit({AddConstraint{velocity(1, target)}, AddConstraint{velocity(29, 2 * target)}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  const Eigen::Vector3d rest = live.session.geometry()->rest.col(kTip);
  EXPECT_LT(((tip_at(live.session, *result, 2) - rest) * 15 - target).norm(), kSinglePrecision);
  EXPECT_LT(((rest - tip_at(live.session, *result, 28)) * 30 - 2 * target).norm(),
            kSinglePrecision);
}

TEST(SessionVelocities, StayVelocitiesASecondWhenTheFrameRateChanges) {
  Live live(bent_bar());
  const Eigen::Vector3d target(0, 0.9, -0.4), further(0, 0.5, 0.3);
  live.edit({AddConstraint{velocity(15, target)}, AddConstraint{velocity(24, {0.1, 0, 0}, 2)}});
  const auto opened = live.session.final_result();
  // The same swings in frames: nothing but velocities feels it.
  const scene::Dynamics now = live.session.scene().dynamics;
  scene::Dynamics faster = now;
  faster.frames_per_second = 60;
  auto result = live.edit({SetDynamics{testing::requested(faster)}});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->frames_per_second, 60);
  EXPECT_LT((shown_velocity(live, *result, 14, 16, 60) - target).norm(), 2 * kSinglePrecision);
  const auto fresh = test::solve_fresh(live.session.scene(), test::shared_cache());
  EXPECT_NEAR(result->report.total_energy, fresh->report.total_energy,
              1e-6 * fresh->report.total_energy);
  EXPECT_NE(result->report.total_energy, opened->report.total_energy);
  // A move and another rate in one request.
  faster.frames_per_second = 20;
  result = live.edit({MoveConstraint{3, further}, SetDynamics{testing::requested(faster)}});
  EXPECT_LT((shown_velocity(live, *result, 14, 16, 20) - further).norm(), kSinglePrecision);
  result = live.edit({Undo{}, Undo{}});
  EXPECT_LT((shown_velocity(live, *result, 14, 16, 30) - target).norm(), kSinglePrecision);
  EXPECT_NEAR(result->report.total_energy, opened->report.total_energy,
              1e-6 * opened->report.total_energy);
}

TEST(SessionVelocities, EveryKindOfEditEndsAtAColdSolve) {
  Live live(bent_bar());
  live.edit({AddConstraint{velocity(15, {0, 0.9, -0.4}, 20)}});
  scene::Constraint becomes = velocity(20, {0, -0.3, 0});
  becomes.id = 2;
  live.edit({ReplaceConstraint{becomes}});  // a displacement becomes a velocity
  live.edit({MoveConstraint{3, {0, 1.1, -0.2}}});
  live.edit({MoveConstraint{2, {0.1, -0.4, 0.1}}});
  const auto expect_cold = [&](const std::shared_ptr<const BodyResult>& final) {
    const auto fresh = test::solve_fresh(live.session.scene(), test::shared_cache());
    ASSERT_TRUE(final && fresh);
    EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
    // What edits lead to may be the lower one of two optima. Energies of what can be met without
    // forces are rounding.
    EXPECT_LE(final->report.total_energy, (1 + 1e-6) * fresh->report.total_energy + 1e-20);
  };
  expect_cold(live.edit({SetDynamics{{30, 25, 0.05}}}));
  expect_cold(live.edit({RemoveConstraint{3}, SetEnds{End::kPinnedPosition, End::kFree}}));
  scene::Constraint back = held(20, kTip, {0, -0.1, 0.02});
  back.id = 2;
  const auto final = live.edit({ReplaceConstraint{back}});
  expect_cold(final);
  EXPECT_EQ(final->report.max_velocity_error, 0);
}

TEST(SessionVelocities, UndoAndRedoComeBackToTheVeryAnswer) {
  Live live(bent_bar());
  const auto before = live.recorder->wait_final(0);
  const auto added = live.edit({AddConstraint{velocity(15, {0, 0.9, -0.4})}});
  const auto moved = live.edit({MoveConstraint{3, {0, 0.2, 0.4}}});
  EXPECT_EQ(live.edit({Undo{}})->coordinates, added->coordinates);
  EXPECT_EQ(live.edit({Undo{}})->coordinates, before->coordinates);
  EXPECT_EQ(live.edit({Redo{}, Redo{}})->coordinates, moved->coordinates);
}

TEST(SessionVelocities, MillimetresChangeNothingButNumbers) {
  scene::Scene metres = bent_bar();
  metres.constraints.push_back(velocity(15, {0, 0.9, -0.4}, 20));
  scene::Scene millimetres = metres;
  millimetres.length_unit_in_metres = 1e-3;
  millimetres.mesh.nodes *= 1000;
  for (auto& constraint : millimetres.constraints) constraint.target *= 1000;
  const auto a = test::solve_fresh(metres, test::shared_cache());
  const auto b = test::solve_fresh(millimetres, test::shared_cache());
  EXPECT_NEAR(a->report.total_energy, b->report.total_energy, 1e-9 * a->report.total_energy);
  EXPECT_NEAR(a->report.max_velocity_error, b->report.max_velocity_error,
              1e-6 * a->report.max_velocity_error);
}

/// The velocity is that of the frames, the base motion's part of it included.
TEST(SessionVelocities, OverABaseMotionCountItToo) {
  Live source(bent_bar());
  const auto motion = source.recorder->wait_final(0);
  ASSERT_TRUE(motion);
  const Eigen::MatrixXd positions = source.session.positions(*motion, 0, 30);
  scene::Scene scene = test::bar(test::kCells, 30);
  scene.base_motion = positions.colwise() - positions.col(0);
  const Eigen::Vector3d base =
      (scene.base_motion.col(16) - scene.base_motion.col(14)).segment<3>(3 * kTip) * 15;
  ASSERT_GT(base.norm(), 0.1);
  Live live(scene);
  const auto kept = live.edit({AddConstraint{velocity(15, base)}});
  EXPECT_LT(kept->report.total_energy, 1e-4) << "the base motion has it";
  const Eigen::Vector3d target = base + Eigen::Vector3d(0, 0.3, 0);
  const auto result = live.edit({MoveConstraint{1, target}});
  EXPECT_LT((shown_velocity(live, *result, 14, 16, 30) - target).norm(), kSinglePrecision);
  // From a frame that the end holds: the base motion is all that it does there.
  const auto beside = live.edit({AddConstraint{velocity(2, {0, 0.1, 0})}});
  EXPECT_LT((shown_velocity(live, *beside, 1, 3, 30) - Eigen::Vector3d(0, 0.1, 0)).norm(),
            kSinglePrecision);
}

TEST(SessionVelocities, WithoutEffectAreWarnedOf) {
  Live live(bent_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  const auto issues = [&](const BodyEdit& edit) { return live.session.edit({edit}).issues; };
  EXPECT_THAT(issues(AddConstraint{velocity(1, {0, 0, 0})}), ::testing::IsEmpty());
  const auto idle = issues(AddConstraint{velocity(0, {0, 0, 0})});
  ASSERT_EQ(idle.size(), 1u);
  EXPECT_EQ(idle[0].field, "edits[0].add.constraint.frame");
  EXPECT_THAT(idle[0].message, ::testing::HasSubstr("frames 0 and 1, whose difference"));
  scene::Constraint fixed = velocity(15, {0, 0, 0});
  fixed.nodes = {test::bar_node(test::kCells, 0, 0, 0)};
  const auto unmoved = issues(AddConstraint{fixed});
  ASSERT_EQ(unmoved.size(), 1u);
  EXPECT_EQ(unmoved[0].field, "edits[0].add.constraint.nodes");
  EXPECT_THAT(issues(SetEnds{End::kFree, End::kPinnedPosition}), ::testing::IsEmpty());
  EXPECT_EQ(issues(SetEnds{End::kPinnedPositionVelocity, End::kPinnedPosition}).size(), 1u);
}

TEST(SessionVelocities, AreMetByAFittedMaterial) {
  scene::Scene scene = bent_bar();
  scene.material_optimisation.variables = scene::MaterialVariables::kAll;
  const Eigen::Vector3d target(0, 0.9, -0.4);
  scene.constraints.push_back(velocity(15, target));
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_GT(result->material_iterations, 0);
  EXPECT_LT((shown_velocity(live, *result, 14, 16, 30) - target).norm(), kSinglePrecision);
}

}  // namespace
}  // namespace limber::session
