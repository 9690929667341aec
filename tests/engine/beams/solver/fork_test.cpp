// Supports and motions that hold a node about one axis alone.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/structure/elastic.h"
#include "engine/beams/structure/swing_twist.h"
#include "tests/support/beam_problems.h"

namespace limber::beams::fork_test {
namespace {

using Eigen::Vector3d;

constexpr BeamMethod kMethods[] = {BeamMethod::kNewton, BeamMethod::kRelaxation,
                                   BeamMethod::kRelaxationThenNewton, BeamMethod::kChoose};

/// A beam of 2 m on a fork and a roller, of unit bending stiffness in one plane and of 2 in the
/// other.
BeamModel beam(const Vector3d& force, int elements = 12) {
  BeamModel model = limber::testing::straight_beam(elements, 2);
  model.sections[0].bending_3 = 2;
  model.supports = {{0, {true, true, true, true, false, false}},
                    {elements, {false, true, true, false, false, false}}};
  model.loads = {{elements / 2, force}};
  return model;
}

/// A strip, which buckles sideways under a force of 6 in its plane.
BeamModel strip(const Vector3d& force) {
  BeamModel model = beam(force);
  model.sections[0].bending_3 = 25;
  model.sections[0].torsion = 2;
  return model;
}

BeamSolution solve(const BeamModel& model, BeamMethod method = BeamMethod::kChoose) {
  BeamSolveOptions options;
  options.method = method;
  options.relaxation_tolerance = 1e-8;
  return find_equilibrium(BeamStructure(model), options);
}

double twist_about_x(const BeamState& state, int node) {
  return swing_and_twist(state.rotations[static_cast<std::size_t>(node)], 0, 0).twist;
}

double distance(const BeamState& a, const BeamState& b) {
  return (a.positions - b.positions).colwise().norm().maxCoeff();
}

TEST(BeamFork, AllMethodsGiveOneAnswer) {
  const BeamModel model = strip({0, -40, -4});
  const BeamSolution first = solve(model);
  ASSERT_TRUE(first.report.converged()) << first.report.message;
  EXPECT_GT(first.state.positions.bottomRows(2).cwiseAbs().maxCoeff(), 0.3) << "it bends far";
  EXPECT_NEAR(twist_about_x(first.state, 0), 0, 1e-13);
  for (const BeamMethod method : kMethods) {
    const BeamSolution found = solve(model, method);
    ASSERT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
    EXPECT_LT(distance(found.state, first.state), 1e-6) << to_string(method);
    EXPECT_NEAR(twist_about_x(found.state, 0), 0, 1e-12) << to_string(method);
  }
}

/// Any path: y first, or z, or both at once, or through something else.
TEST(BeamFork, TheAnswerDoesNotDependOnThePath) {
  const Vector3d y(0, -6, 0), z(0, 0, -4);
  const BeamSolution fresh = solve(beam(y + z));
  for (const std::vector<Vector3d>& path :
       {std::vector<Vector3d>{y, y + z}, {z, y + z}, {-0.5 * y + z, 0.5 * y - z, y + z}}) {
    BeamSolution at = solve(beam({0, 0, -1e-3}));
    for (const Vector3d& force : path) {
      at = follow_equilibrium(BeamStructure(beam(force)), at.state, {},
                              BeamSolveOptions::following());
      ASSERT_TRUE(at.report.converged()) << at.report.message;
    }
    EXPECT_LT(distance(at.state, fresh.state), 1e-7);
  }
}

TEST(BeamFork, ClosedLoopsOfEditsReturnAndLeaveNoForce) {
  BeamSolution at = solve(beam({0, 0, -4}));
  const BeamState start = at.state;
  for (int lap = 0; lap < 3; ++lap) {
    for (const Vector3d& force : {Vector3d(0, -6, 0), Vector3d(0, -6, -4), Vector3d(0, 0, -4)}) {
      at = follow_equilibrium(BeamStructure(beam(force)), at.state, {},
                              BeamSolveOptions::following());
      ASSERT_TRUE(at.report.converged()) << at.report.message;
    }
    EXPECT_LT(distance(at.state, start), 1e-7) << "lap " << lap;
  }
  const BeamStructure unloaded(beam({0, 0, 0}));
  at = follow_equilibrium(unloaded, at.state, {}, BeamSolveOptions::following());
  ASSERT_TRUE(at.report.converged()) << at.report.message;
  const BeamResults results = results_of(unloaded, at.state);
  EXPECT_LT(results.reaction_moments.norm(), 1e-8);
  EXPECT_LT(results.reaction_forces.norm(), 1e-7);
  EXPECT_LT(results.energies.total(), 1e-15);
  EXPECT_LT(at.state.rotations[0].angularDistance(Eigen::Quaterniond::Identity()), 1e-7);
}

/// Which axes across the held one a support names makes no difference.
TEST(BeamFork, AllDirectionsAcrossTheAxisAreAlike) {
  BeamModel model = beam({0, -6, -4});
  const BeamSolution first = solve(model);
  model.supports[0].axes = rotation_by({0.7, 0, 0}).toRotationMatrix();
  const BeamSolution turned = solve(model);
  ASSERT_TRUE(turned.report.converged()) << turned.report.message;
  EXPECT_LT(distance(first.state, turned.state), 1e-8);
}

/// Work of the support is energy: it has a potential. Its moment is one about the axis that goes
/// along with half of the swing.
TEST(BeamFork, TheTorqueOfAMotionIsTheChangeOfEnergyByItsAngle) {
  const auto potential = [](double angle, double* torque) {
    BeamModel model = beam({0, -6, -4});
    model.supports[0].fixed[3] = false;
    model.supports[1].fixed[3] = true;
    PrescribedMotion motion;
    motion.node = 0;
    motion.rotates = {true, false, false};
    motion.rotation = {angle, 0, 0};
    model.motions = {motion};
    const BeamStructure structure(model);
    const BeamSolution found = find_equilibrium(structure);
    EXPECT_TRUE(found.report.converged()) << found.report.message;
    EXPECT_NEAR(twist_about_x(found.state, 0), angle, 1e-12);
    const SwingTwist parts = swing_and_twist(found.state.rotations[0], 0, angle);
    if (torque != nullptr)
      *torque = results_of(structure, found.state)
                    .reaction_moments.col(0)
                    .dot(half_of(parts.swing) * Vector3d(Vector3d::UnitX())) *
                parts.swing.w();
    return elastic_energies(structure, found.state).total() -
           model.loads[0].force.dot(found.state.positions.col(6) - model.nodes[6].position);
  };
  double torque = 0;
  (void)potential(0.8, &torque);
  const double h = 1e-3;
  EXPECT_NEAR((potential(0.8 + h, nullptr) - potential(0.8 - h, nullptr)) / (2 * h), torque,
              1e-5 * std::abs(torque));
  EXPECT_GT(std::abs(torque), 0.1);
}

/// Two hinges one behind the other, at a node that is held or turned: a universal joint. In a
/// plane, or without bending, the fork is the same.
BeamModel with_universal_joint(BeamModel model, const PrescribedMotion& motion) {
  model.elements[0].start_release.rotations = {false, true, true};
  model.supports.erase(model.supports.begin());
  model.supports.push_back({0, {true, true, true, false, false, false}});
  PrescribedMotion all = motion;
  all.rotates = {true, true, true};
  model.motions = {all};
  return model;
}

TEST(BeamFork, TurnedWithoutBendingItTwistsLikeAUniversalJoint) {
  // No bending: several turns, about the axis alone.
  BeamModel model = beam({0, 0, 0}, 16);
  model.supports[0].fixed[3] = false;
  model.supports[1].fixed[3] = true;
  PrescribedMotion motion;
  motion.node = 0;
  motion.rotates = {true, false, false};
  motion.rotation = {7, 0, 0};
  model.motions = {motion};
  model.sections[0].bending_2 = model.sections[0].bending_3 = 25;  // stiff against the torque
  const BeamStructure structure(model);
  const BeamStructure joint(with_universal_joint(model, motion));
  for (const BeamMethod method : kMethods) {
    BeamSolveOptions options;
    options.method = method;
    const BeamSolution found = find_equilibrium(structure, options);
    const BeamSolution other = find_equilibrium(joint, options);
    ASSERT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
    ASSERT_TRUE(other.report.converged()) << to_string(method) << ": " << other.report.message;
    const double torque = results_of(structure, found.state).reaction_moments(0, 0);
    EXPECT_NEAR(torque, results_of(joint, other.state).reaction_moments(0, 0), 1e-6 * torque);
    EXPECT_NEAR(torque, 7 / 2.0, 2e-3 * torque) << "G J / L";
  }
}

TEST(BeamFork, InAPlaneItBendsLikeAUniversalJointAndTwistsNearlyLikeOne) {
  BeamModel model = beam({0, 0, -4});
  model.supports[0].fixed[3] = false;
  model.supports[1].fixed[3] = true;
  PrescribedMotion motion;
  motion.node = 0;
  motion.rotates = {true, false, false};
  for (const double angle : {0.0, 0.3}) {
    motion.rotation.x() = angle;
    model.motions = {motion};
    const BeamSolution found = solve(model);
    const BeamSolution joint = solve(with_universal_joint(model, motion));
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    ASSERT_TRUE(joint.report.converged()) << joint.report.message;
    EXPECT_LT(distance(found.state, joint.state), angle == 0 ? 1e-7 : 0.02);
    EXPECT_GT(found.state.positions.row(2).cwiseAbs().maxCoeff(), 0.3);
  }
}

/// Rolled up in a plane by a moment, the end swings by half a turn and more: nothing happens there.
TEST(BeamFork, ASwingGoesOnPastHalfATurn) {
  for (const double turns : {0.45, 0.5, 0.7}) {
    BeamModel model = limber::testing::straight_beam(20);
    model.sections[0].bending_3 = 2;
    model.supports = {limber::testing::clamped(0), {20, {false, false, false, true, false, false}}};
    for (int i = 1; i < 20; ++i)
      model.supports.push_back({i, {false, true, false, true, false, true}});
    model.loads = {{20, {0, 0, 0}, {0, -2 * std::numbers::pi * turns, 0}}};
    BeamModel planar = model;
    planar.supports[1].fixed = {false, true, false, true, false, true};
    const BeamSolution expected = solve(planar);
    ASSERT_TRUE(expected.report.converged());
    const BeamSolution found = solve(model);
    ASSERT_TRUE(found.report.converged()) << turns << ": " << found.report.message;
    EXPECT_LT(distance(found.state, expected.state), 1e-6) << turns;
    EXPECT_EQ(found.report.message.find("half a turn") != std::string::npos, turns == 0.5)
        << found.report.message;
  }
}

/// A moment of fixed direction on such a node: what diverges is judged on the spins that it has.
TEST(BeamFork, MomentsOfFixedDirectionAreFoundByTheTangent) {
  BeamModel model = beam({0, 0, 0});
  model.loads = {{0, {0, 0, 0}, {0.3, 1.2, -1.5}}};
  const BeamSolution first = solve(model);
  ASSERT_TRUE(first.report.converged()) << first.report.message;
  for (const BeamMethod method : kMethods) {
    const BeamSolution found = solve(model, method);
    ASSERT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
    EXPECT_LT(distance(found.state, first.state), 1e-6) << to_string(method);
  }
}

}  // namespace
}  // namespace limber::beams::fork_test
