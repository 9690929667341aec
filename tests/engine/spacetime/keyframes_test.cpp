#include <gtest/gtest.h>

#include <cmath>

#include "engine/spacetime/material_solver.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/chain_kinematics.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;
using testing::uniform;

constexpr int kKeyedCoordinates = 7, kKeyedModes = 4, kKeyedFrames = 40;

struct KeyedScene {
  std::shared_ptr<const reduced::Kinematics> kinematics =
      std::make_shared<LinearKinematics>(kKeyedCoordinates, 3, 2.0, 5);
  Timeline timeline{kKeyedFrames, EndCondition::kPinnedPositionVelocity, EndCondition::kFree};
  Material material{test_dynamics(kKeyedModes, 30, 0.02), {}};
  std::vector<PositionConstraint> positions;
  std::vector<KeyframeConstraint> keyframes;

  KeyedScene() {
    std::mt19937_64 generator(11);
    material.mixing = first_coordinates(kKeyedCoordinates, kKeyedModes);
    for (auto& value : material.mixing.reshaped()) value += 0.2 * uniform(generator);
    for (const int frame : {9, 21, 22, 39}) {
      KeyframeConstraint keyframe;
      keyframe.id = static_cast<ConstraintId>(frame);
      keyframe.frame = frame;
      keyframe.weight = 3 + frame;
      keyframe.coordinates.resize(kKeyedCoordinates);
      for (auto& value : keyframe.coordinates) value = uniform(generator);
      keyframes.push_back(keyframe);
    }
    positions.push_back({9, 21, 1, 5, {0.3, -0.2, 0.4}, 50});  // the id of a keyframe too
    positions.push_back({2, 30, 0, 7, {0.1, 0.5, -0.3}, 80});
  }

  [[nodiscard]] Solver solver() const {
    Solver made(kinematics, material.dynamics, timeline, {}, material.mixing);
    for (const auto& constraint : positions) made.add(constraint);
    for (const auto& keyframe : keyframes) made.add_keyframe(keyframe);
    return made;
  }

  /// Eqs. 17a, 17b and 23 of a whole motion, as they are written.
  [[nodiscard]] double energy(const Eigen::MatrixXd& z) const {
    double sum = force_energy(material.dynamics, z);
    for (const auto& keyframe : keyframes) {
      sum += 0.5 * keyframe.weight *
             (material.mixing * z.col(keyframe.frame) - keyframe.coordinates).squaredNorm();
    }
    for (const auto& constraint : positions) {
      Eigen::Matrix3Xd u;
      const reduced::SiteQuery query{constraint.site, 0};
      kinematics->evaluate({&constraint.frame, 1}, material.mixing * z.col(constraint.frame),
                           {&query, 1}, u, nullptr);
      for (int axis = 0; axis < 3; ++axis) {
        if ((constraint.axes >> axis & 1U) == 0) continue;
        const double miss = (constraint.target[axis] - u(axis, 0)) / kinematics->length();
        sum += 0.5 * constraint.weight * miss * miss;
      }
    }
    return sum;
  }
};

/// The problem is a convex quadratic one: where its gradient vanishes is the answer.
TEST(Keyframes, WithPositionsAndMixedModesMeetTheQuadraticOptimum) {
  const KeyedScene scene;
  Solver solver = scene.solver();
  const SolveReport report = solver.solve();
  ASSERT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_NEAR(report.total_energy, scene.energy(solver.motion()), 1e-10 * report.total_energy);
  Eigen::MatrixXd z = solver.motion();
  for (Eigen::Index i = 2; i < kKeyedFrames; ++i) {
    for (Eigen::Index k = 0; k < kKeyedModes; ++k) {
      const double before = z(k, i), h = 1e-3;
      z(k, i) = before + h;
      const double above = scene.energy(z);
      z(k, i) = before - h;
      const double below = scene.energy(z);
      z(k, i) = before;
      EXPECT_NEAR((above - below) / (2 * h), 0, 1e-6) << k << " " << i;
    }
  }
  double largest = 0;
  for (const auto& keyframe : scene.keyframes) {
    largest = std::max(
        largest, (scene.material.mixing * z.col(keyframe.frame) - keyframe.coordinates).norm());
  }
  EXPECT_NEAR(report.max_keyframe_error, largest, 1e-12);
}

TEST(Keyframes, WhatNoModeMovesIsAMissAndNoRow) {
  KeyedScene scene;
  scene.material.mixing = first_coordinates(kKeyedCoordinates, kKeyedModes);
  Solver plain(scene.kinematics, scene.material.dynamics, scene.timeline);
  Solver mixed = scene.solver();
  for (const auto& constraint : scene.positions) plain.add(constraint);
  for (const auto& keyframe : scene.keyframes) plain.add_keyframe(keyframe);
  const SolveReport a = plain.solve(), b = mixed.solve();
  EXPECT_NEAR(a.total_energy, b.total_energy, 1e-10 * a.total_energy);
  EXPECT_NEAR(a.total_energy, scene.energy(plain.motion()), 1e-10 * a.total_energy);
  EXPECT_GT(a.max_keyframe_error, scene.keyframes[0].coordinates.tail(3).norm() - 1e-12);
}

TEST(Keyframes, ExactOnesAreMet) {
  KeyedScene scene;
  scene.positions.clear();
  scene.material.mixing = Eigen::MatrixXd::Identity(kKeyedCoordinates, kKeyedCoordinates);
  scene.material.dynamics = test_dynamics(kKeyedCoordinates, 30, 0.02);
  for (auto& keyframe : scene.keyframes) keyframe.weight = PositionConstraint::kExact;
  Solver solver = scene.solver();
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_LT(report.max_keyframe_error, 1e-7);
}

TEST(Keyframes, ComeAndGoLikeOtherConstraints) {
  const KeyedScene scene;
  Solver solver = scene.solver();
  const double with = solver.solve().total_energy;
  solver.remove_keyframe(21);
  EXPECT_LT(solver.solve().total_energy, with);
  solver.add_keyframe(scene.keyframes[1]);
  EXPECT_NEAR(solver.solve().total_energy, with, 1e-9 * with);
  EXPECT_THROW(solver.add_keyframe(scene.keyframes[1]), Error);
  EXPECT_THROW(solver.remove_keyframe(5), Error);
  KeyframeConstraint wrong = scene.keyframes[0];
  wrong.id = 99;
  wrong.coordinates.conservativeResize(kKeyedCoordinates - 1);
  try {
    solver.add_keyframe(wrong);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "keyframe.coordinates");
  }
}

/// A body that bends: material optimisation moves S to where the poses are.
TEST(Keyframes, MaterialOptimisationMixesModesTowardsThePoses) {
  KeyedScene scene;
  scene.kinematics = std::make_shared<ChainKinematics>(kKeyedCoordinates, 8, 1.0, 2.0, 3);
  scene.material.mixing = first_coordinates(kKeyedCoordinates, kKeyedModes);
  scene.positions.resize(1);
  Solver solver = scene.solver();
  const SolveReport z_only = solver.solve();
  MaterialOptions options;
  options.max_iterations = 500;
  MaterialSolver material(scene.kinematics, scene.timeline, solver.constraint_set(), scene.material,
                          solver.motion(), options);
  const MaterialReport report = material.solve();
  EXPECT_LT(report.total_energy, 0.5 * z_only.total_energy);
  EXPECT_LT(report.max_keyframe_error, 0.5 * z_only.max_keyframe_error);
  scene.material = material.material();
  EXPECT_NEAR(report.total_energy - report.column_energy, scene.energy(material.motion()),
              1e-9 * report.total_energy);
}

}  // namespace
}  // namespace limber::spacetime
