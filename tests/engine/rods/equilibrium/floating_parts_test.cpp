#include "engine/rods/equilibrium/floating_parts.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "engine/base/random.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using testing::curved_model;
using testing::joint_distance;

Eigen::Isometry3d far_away() {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()));
  motion.pretranslate(Eigen::Vector3d(300, -200, 50));
  return motion;
}

TEST(FloatingParts, ARigidMotionLeavesEnergyForcesAndTwistsAsTheyAre) {
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  ASSERT_TRUE(equilibrium.solve(state, {}).converged());
  LinkageState moved = state.moved_rigidly(model, 0, far_away());
  LinkageAssembly assembly(model);
  const double energy = assembly.energies(state).total();
  EXPECT_NEAR(assembly.energies(moved).total(), energy, 1e-9 * energy);
  EXPECT_EQ(moved.joints()[3].opening_angle, state.joints()[3].opening_angle);
  EXPECT_NEAR(moved.twist(model, 2, 3), state.twist(model, 2, 3), 1e-12);
  EXPECT_LT((moved.vertex(model, 2, 3) - far_away() * state.vertex(model, 2, 3)).norm(), 1e-9);
  // Joints, too: what is solved from there is balanced already.
  LinkageState again = moved;
  const EquilibriumReport report = equilibrium.solve(again, {}, {.tolerance = 1e-6});
  EXPECT_TRUE(report.converged());
  EXPECT_EQ(report.iterations, 0);
  EXPECT_LT(joint_distance(again, moved), 1e-9);
}

/// However an edge is turned: by increments twists would end in another branch near half a turn.
TEST(FloatingParts, TurnsOfAnyAngleLeaveTwistsInTheirBranch) {
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  ASSERT_TRUE(equilibrium.solve(state, {}).converged());
  LinkageAssembly assembly(model);
  const double energy = assembly.energies(state).total();
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector3d axis(random.normal(), random.normal(), random.normal());
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.rotate(Eigen::AngleAxisd(std::numbers::pi - 0.02 * k, axis.normalized()));
    const LinkageState turned = state.moved_rigidly(model, 0, motion);
    EXPECT_NEAR(assembly.energies(turned).total(), energy, 1e-9 * energy) << k;
    for (int s = 0; s < model.variables().segments(); ++s)
      ASSERT_NEAR(turned.twist(model, s, 2), state.twist(model, s, 2), 1e-12) << k;
  }
}

TEST(FloatingParts, WhatNothingTouchesComesBackToWhereItWas) {
  const LinkageModel model = curved_model();
  const LinkageState drawn(model);
  LinkageState state = drawn.moved_rigidly(model, 0, far_away());
  ASSERT_GT(joint_distance(state, drawn), 100);
  keep_in_place(model, {}, {}, drawn, state);
  EXPECT_LT(joint_distance(state, drawn), 1e-9);
  EXPECT_LT((state.director(model, 4, 2) - drawn.director(model, 4, 2)).norm(), 1e-12);
}

TEST(FloatingParts, PinsAndSpringsKeepAPartWhereItIsAndLoadsHowItTurns) {
  const LinkageModel model = curved_model();
  const LinkageState drawn(model);
  LinkageState away = drawn.moved_rigidly(model, 0, far_away());
  Conditions pinned, sprung, loaded, opened;
  pinned.pins = {{5}};
  sprung.springs = {{JointPoint{2}, Eigen::Vector3d::Zero(), 1}};
  loaded.loads = {{2, Eigen::Vector3d(1, 0, 0)}, {7, Eigen::Vector3d(-1, 0, 0)}};
  opened.loads.push_back({.joint = 2, .opening_torque = 1});
  for (const Conditions& conditions : {pinned, sprung}) {
    LinkageState state = away;
    keep_in_place(model, {}, conditions, drawn, state);
    EXPECT_LT(joint_distance(state, away), 1e-12);
  }
  // Pins that have been released hold nothing any more; springs fade along the path.
  LinkageState state = away;
  keep_in_place(model, pinned, {}, drawn, state);
  EXPECT_LT(joint_distance(state, drawn), 1e-9);
  state = away;
  keep_in_place(model, sprung, {}, drawn, state);
  EXPECT_LT(joint_distance(state, away), 1e-12);
  state = away;
  keep_in_place(model, {}, loaded, drawn, state);
  EXPECT_LT((state.joints()[0].normal - away.joints()[0].normal).norm(), 1e-12);
  EXPECT_LT(joint_distance(state, drawn), joint_distance(away, drawn) / 2);
  // Torques between two rods of a joint turn with it.
  state = away;
  keep_in_place(model, {}, opened, drawn, state);
  EXPECT_LT(joint_distance(state, drawn), 1e-9);
}

TEST(FloatingParts, ALoneStraightRodStaysInPlace) {
  LineMesh mesh;
  mesh.vertices.resize(3, 2);
  mesh.vertices << 0, 100, 0, 0, 0, 0;
  mesh.edges.resize(2, 1);
  mesh.edges << 0, 1;
  const LinkageModel model(build_linkage_graph(mesh), 6, testing::kStrip);
  const LinkageState drawn(model);
  LinkageState state = drawn;
  keep_in_place(model, {}, {}, drawn, state);
  EXPECT_LT((state.director(model, 0, 3) - drawn.director(model, 0, 3)).norm(), 1e-12);
  state = state.moved_rigidly(model, 0, far_away());
  keep_in_place(model, {}, {}, drawn, state);
  EXPECT_LT((state.vertex(model, 0, 0) - drawn.vertex(model, 0, 0)).norm(), 1e-9);
}

}  // namespace
}  // namespace limber::rods
