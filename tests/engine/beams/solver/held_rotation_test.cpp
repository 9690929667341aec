#include "engine/beams/solver/held_rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/beams/structure/beam_structure.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using detail::HeldRotation;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Matrix3d oblique() { return rotation_by(Vector3d(0.4, -0.7, 1.1)).toRotationMatrix(); }

/// exp(spin) by axes, from the left.
Quaterniond spun(const Matrix3d& axes, const Vector3d& spin, const Quaterniond& q) {
  return rotation_by(axes * spin) * q;
}

double part_about(const Vector3d& axis, const Quaterniond& q) {
  return 2 * std::atan2(q.vec().dot(axis), q.w());
}

TEST(HeldRotation, AboutTwoAxesIsReachedInOneSpinThatLeavesTheThirdAlone) {
  const Matrix3d axes = oblique();
  const Quaterniond start = rotation_by(Vector3d(0.3, 0.5, -0.8));
  const Vector3d target(0.9, 0, -0.4);
  const HeldRotation held({true, false, true}, axes, start, target, {});
  EXPECT_LT(held.spin(start, 0).norm(), 1e-14) << "at s = 0 it is where it is";
  const Vector3d spin = held.spin(start, 1);
  EXPECT_EQ(spin.y(), 0);
  const Quaterniond there = spun(axes, spin, start);
  EXPECT_LT(held.spin(there, 1).norm(), 1e-14);
  // exp(psi e_2) exp(target): some turn about the free axis, in space, comes last.
  const Quaterniond rest = there * rotation_by(axes * target).conjugate();
  EXPECT_LT(rest.vec().cross(Vector3d(axes.col(1))).norm(), 1e-14);
  EXPECT_LT(held.spin(spun(axes, {0, 2.5, 0}, there), 1).norm(), 1e-14) << "which is free";
}

TEST(HeldRotation, AboutOneAxisAloneItIsTheTwistAboutIt) {
  BeamModel model = limber::testing::straight_beam(1);
  model.supports = {{0, {true, true, true, false, true, false}, oblique()}};
  const BeamStructure structure(model);
  const Quaterniond start = rotation_by(Vector3d(0.3, 0.5, -0.8));
  const HeldRotation held({false, true, false}, oblique(), start, {0, 0.4, 0}, {});
  EXPECT_LT(held.spin(start, 0).norm(), 1e-14) << "at s = 0 it is where it is";
  const Vector3d spin = held.spin(start, 1);
  EXPECT_EQ(spin.x(), 0);
  EXPECT_EQ(spin.z(), 0);
  const Quaterniond there = spun(structure.spin_axes(0, start), spin, start);
  EXPECT_LT(held.spin(there, 1).norm(), 1e-14) << "in one spin";
  EXPECT_NEAR(part_about(oblique().col(1), there), 0.4, 1e-14);
  // What the free axes do leaves nothing behind, on any way.
  Quaterniond away = there;
  for (const Vector3d& free : {Vector3d(1.2, 0, 0.4), Vector3d(-0.3, 0, 2), Vector3d(0.9, 0, -1)})
    away = spun(structure.spin_axes(0, away), free, away);
  EXPECT_LT(held.spin(away, 1).norm(), 1e-14);
}

TEST(HeldRotation, ContinuesFromTurnsThatAreKnown) {
  // 5 turns about the first axis look like none.
  const Matrix3d axes = oblique();
  const Quaterniond start = rotation_by(10 * std::numbers::pi * axes.col(0));
  for (const auto& held :
       {std::array{true, false, false}, {true, true, false}, {true, true, true}}) {
    const HeldRotation known(held, axes, start, {11 * std::numbers::pi, 0, 0},
                             Vector3d(10 * std::numbers::pi, 0, 0));
    EXPECT_NEAR(known.angle(), std::numbers::pi, 1e-12);
    const HeldRotation unknown(held, axes, start, {0, 0, 0}, {});
    EXPECT_NEAR(unknown.angle(), 0, 1e-12);
    // A wrong value is not used.
    const HeldRotation wrong(held, axes, start, {0, 0, 0}, Vector3d(1, 0, 0));
    EXPECT_NEAR(wrong.angle(), 0, 1e-12);
  }
}

TEST(HeldRotation, ATiltByHalfATurnAndMoreLeavesTheTurntableDefined) {
  const Matrix3d axes = oblique();
  const double psi = 0.7;
  for (const double tilt : {std::numbers::pi - 1e-9, std::numbers::pi, std::numbers::pi + 1e-9,
                            1.7 * std::numbers::pi, 4 * std::numbers::pi}) {
    const Quaterniond start = rotation_by(psi * axes.col(2)) * rotation_by(tilt * axes.col(0));
    const HeldRotation held({true, true, false}, axes, start, {tilt + 0.1, 0, 0},
                            Vector3d(tilt, 0, 0));
    EXPECT_NEAR(held.angle(), 0.1, 1e-12) << tilt;
    // From there a spin about the tilted axis, which the turntable carries with it.
    const Vector3d carried(std::cos(psi), std::sin(psi), 0);
    EXPECT_LT((held.spin(start, 1) - 0.1 * carried).norm(), 1e-12) << tilt;
  }
}

/// A rod along an axis of no special direction, one end clamped, the other driven by its own axes.
struct ObliqueRod {
  explicit ObliqueRod(int elements) : model(limber::testing::straight_beam(elements)) {
    for (BeamNode& node : model.nodes) {
      node.position = axes * node.position;
      node.normal = axes * node.normal;
    }
    model.supports.push_back(limber::testing::clamped(0));
    motion.node = elements;
    motion.axes = axes;
  }
  [[nodiscard]] BeamSolution solve(BeamMethod method = BeamMethod::kChoose) {
    model.motions = {motion};
    BeamSolveOptions options;
    options.method = method;
    return find_equilibrium(BeamStructure(model), options);
  }
  [[nodiscard]] Vector3d end(const BeamSolution& found) const {
    return axes.transpose() * found.state.positions.col(motion.node);
  }

  Matrix3d axes = oblique();
  BeamModel model;
  PrescribedMotion motion;
};

TEST(BeamLocalAxes, ARotationAboutOneAxisBendsALongItsOwnCircle) {
  // Turned about its local axis 2, held about 1 and free about 3: an arc of 1 rad.
  for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation}) {
    ObliqueRod rod(20);
    rod.model.supports.push_back({20, {false, false, false, true, false, false}, rod.axes});
    rod.motion.rotates = {false, true, false};
    rod.motion.rotation = {0, -1, 0};
    const BeamSolution found = rod.solve(method);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const Vector3d arc(std::sin(1.0), 0, 1 - std::cos(1.0));
    EXPECT_LT((rod.end(found) - arc).norm(), 1e-4);
    EXPECT_NEAR(part_about(rod.axes.col(1), found.state.rotations[20]), -1, 1e-7);
    // What holds it does no work, by rounding either: else the residual stays near the tolerance.
    EXPECT_LT(found.report.relaxation_steps, 40000);
  }
}

TEST(BeamLocalAxes, ARotationByAFullTurnAboutOneAxisRollsUp) {
  ObliqueRod rod(24);
  // The plane of bending is held, the path in it free.
  for (int i = 1; i <= 24; ++i)
    rod.model.supports.push_back({i, {false, true, false, true, false, true}, rod.axes});
  rod.motion.rotates = {false, true, false};
  rod.motion.rotation = {0, -2 * std::numbers::pi, 0};
  const BeamSolution found = rod.solve();
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_LT(rod.end(found).norm(), 1e-3);
}

TEST(BeamLocalAxes, ASupportMovedAlongItsOwnAxisKeepsTheOthers) {
  // A skew roller: free along its second axis, moved along its first.
  for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation}) {
    ObliqueRod rod(10);
    rod.model.temporary_loads.push_back({5, rod.axes * Vector3d(0, 0, 0.5), {0, 0, 0}});
    const Matrix3d tilted = rod.axes * rotation_by(Vector3d(0, 0.3, 0)).toRotationMatrix();
    rod.model.supports.push_back({10, {false, true, false, true, false, true}, tilted});
    rod.motion.axes = tilted;
    rod.motion.translates = {true, false, false};
    rod.motion.translation = {-0.2, 0, 0};
    const BeamSolution found = rod.solve(method);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const BeamStructure structure(rod.model);
    const Vector3d went =
        tilted.transpose() * (found.state.positions.col(10) - rod.model.nodes[10].position);
    EXPECT_NEAR(went.x(), -0.2, 1e-9);
    EXPECT_NEAR(went.y(), 0, 1e-9);
    EXPECT_GT(std::abs(went.z()), 1e-3) << "free";
  }
}

TEST(BeamLocalAxes, TheSameStructureTurnedAsAWholeHasTheSameShape) {
  // By global axes, then everything turned: a motion by the turned axes gives the turned shape.
  const Matrix3d turn = rotation_by(Vector3d(-0.9, 0.2, 0.6)).toRotationMatrix();
  const auto shape = [](const Matrix3d& axes) {
    BeamModel model = limber::testing::straight_beam(12);
    for (BeamNode& node : model.nodes) {
      node.position = axes * node.position;
      node.normal = axes * node.normal;
    }
    model.supports = {limber::testing::clamped(0),
                      {12, {false, false, false, false, true, false}, axes}};
    PrescribedMotion motion;
    motion.node = 12;
    motion.axes = axes;
    motion.translates = {true, false, true};
    motion.translation = {-0.1, 0, 0.2};
    motion.rotates = {true, false, false};
    motion.rotation = {0.8, 0, 0};
    model.motions = {motion};
    const BeamSolution found = find_equilibrium(BeamStructure(model));
    EXPECT_TRUE(found.report.converged()) << found.report.message;
    return Eigen::Matrix3Xd(axes.transpose() * found.state.positions);
  };
  EXPECT_LT((shape(turn) - shape(Matrix3d::Identity())).cwiseAbs().maxCoeff(), 1e-7);
}

}  // namespace
}  // namespace limber::beams
