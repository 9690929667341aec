#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/session/bodies/weight_scale.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::bent_bar;
using test::held;
using test::kTip;
using test::Live;

TEST(ConstraintTolerance, WeightsAreRaisedTillEveryConstraintIsMet) {
  scene::Scene scene = bent_bar();
  for (auto& constraint : scene.constraints) constraint.weight = 0.01;
  Live loose(scene);
  const auto without = loose.recorder->wait_final(0);
  ASSERT_TRUE(without);
  EXPECT_GT(without->report.max_constraint_error, 1e-2);
  EXPECT_EQ(without->weight_scale, 1);

  scene.constraint_tolerance = 1e-3;
  Live live(scene);
  const auto met = live.recorder->wait_final(0);
  ASSERT_TRUE(met);
  EXPECT_EQ(met->report.status, SolveStatus::kConverged) << met->report.message;
  EXPECT_LE(met->report.max_constraint_error, 1e-3);
  EXPECT_GT(met->report.max_constraint_error, 1e-5) << "no more than it takes";
  EXPECT_GT(met->weight_scale, 1);
  // The weights of the scene stay what they were.
  EXPECT_EQ(live.session.constraints().front().weight, 0.01);
}

TEST(ConstraintTolerance, IsKeptThroughEditsAndTakenBackWhereItIsNotNeeded) {
  scene::Scene scene = bent_bar();
  for (auto& constraint : scene.constraints) constraint.weight = 0.01;
  scene.constraint_tolerance = 1e-3;
  Live live(scene);
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto moved = live.edit({MoveConstraint{1, {0, 0.13, 0.05}}});
  ASSERT_TRUE(moved);
  EXPECT_LE(moved->report.max_constraint_error, 1e-3);
  const auto nowhere = live.edit({MoveConstraint{1, {0, 1e-9, 0}}, MoveConstraint{2, {0, 0, 0}}});
  ASSERT_TRUE(nowhere);
  EXPECT_LT(nowhere->weight_scale, moved->weight_scale);
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_EQ(undone->weight_scale, moved->weight_scale);
  EXPECT_NEAR(undone->report.total_energy, moved->report.total_energy,
              1e-6 * moved->report.total_energy);
}

TEST(ConstraintTolerance, WhatCannotBeMetIsReported) {
  scene::Scene scene = bent_bar();
  scene.constraints.push_back(scene.constraints.front());  // contradicts the first
  scene.constraints.back().target += Eigen::Vector3d(0, 0.1, 0);
  scene.constraint_tolerance = 1e-4;
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->weight_scale, kGreatestWeightScale);
  EXPECT_THAT(result->report.message,
              ::testing::HasSubstr("constraint_tolerance 0.0001 is not met"));
  EXPECT_TRUE(result->modal.allFinite());
}

}  // namespace
}  // namespace limber::session
