// The tangent under moments of fixed direction against the same matrix written out.
#include "engine/rods/equilibrium/moment_tangent.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <numbers>

#include "engine/base/rotations/exponential_map.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using detail::MomentTangent;

constexpr double kBending = 2.0;
constexpr double kTorsion = 1.6;

/// A rod of length 1 along x with a round section; its ends are joints that short rods cross.
LinkageModel rod(int edges, double stretching_by_bending = 2e4, double bending_1 = kBending) {
  LineMesh mesh =
      testing::mesh_of({{0, -.05, 0}, {0, 0, 0}, {0, .05, 0}, {1, -.05, 0}, {1, 0, 0}, {1, .05, 0}},
                       {{0, 1}, {1, 2}, {1, 4}, {3, 4}, {4, 5}});
  return {build_linkage_graph(mesh),
          edges,
          {stretching_by_bending * kBending, bending_1, kBending, kTorsion}};
}

Conditions clamped() {
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}, {1, Hold::kAngle}};
  return conditions;
}

Conditions rolled(double turns) {
  Conditions conditions = clamped();
  conditions.loads = {{1, {0, 0, 0}, {0, -2 * std::numbers::pi * turns * kBending, 0}, 0}};
  return conditions;
}

/// Where the arc ends that a rod of length 1 makes.
Eigen::Vector3d end_of_arc(double turns) {
  const double angle = 2 * std::numbers::pi * turns;
  return {std::sin(angle) / angle, 0, (1 - std::cos(angle)) / angle};
}

Eigen::MatrixXd dense(const CondensedMatrix& matrix, int size) {
  Eigen::MatrixXd result(size, size);
  for (int k = 0; k < size; ++k) {
    Eigen::VectorXd column(size);
    matrix.multiply(Eigen::VectorXd::Unit(size, k), column);
    result.col(k) = column;
  }
  return result;
}

/// Rows and columns of what is fixed become those of the identity.
Eigen::MatrixXd held(Eigen::MatrixXd matrix, const std::vector<int>& fixed) {
  for (const int unknown : fixed) {
    matrix.row(unknown).setZero();
    matrix.col(unknown).setZero();
    matrix(unknown, unknown) = 1;
  }
  return matrix;
}

/// Beside the state that a moment alone bends the rod to, or a force alone presses it straight.
void check_tangent(const LinkageModel& model, const LinkageState& state,
                   const std::vector<Eigen::Vector3d>& moments_at_end, int least_unstable) {
  LinkageAssembly assembly(model);
  const int size = model.variables().size();
  Eigen::VectorXd gradient(size);
  CondensedMatrix material(model.chains()), matrix(model.chains());
  (void)assembly.hessian(state, gradient, material, Compression::kUnstressed);
  EXPECT_LT(gradient.norm(), 1e-9);
  (void)assembly.hessian(state, gradient, matrix);
  HessianFactor factor(model.chains());
  const int first = model.variables().joint_begin(0);
  for (int k = 0; k < 7; ++k) factor.fixed.push_back(first + k);
  factor.fixed.push_back(model.variables().joint_begin(1) + kJointAngle);
  factor.solver.set_pinned(factor.fixed);
  (void)factor.solver.factor(matrix);
  factor.border(Eigen::MatrixXd(0, size));
  const Eigen::VectorXd diagonal = 1e-3 * detail::UnknownScales(model).weights();
  const Eigen::MatrixXd weighed =
      held(dense(material, size) + Eigen::MatrixXd(diagonal.asDiagonal()), factor.fixed);

  for (const Eigen::Vector3d& moment : moments_at_end) {
    const std::vector<int> rotations = {model.variables().joint_begin(1) + kJointRotation};
    Eigen::VectorXd moments = Eigen::VectorXd::Zero(size);
    moments.segment<3>(rotations[0]) = moment;
    const MomentTangent tangent(factor, rotations, moments);

    Eigen::MatrixXd whole = dense(matrix, size);
    whole.block<3, 3>(rotations[0], rotations[0]) -= 0.5 * rotations::cross_matrix(moment);
    whole = held(whole, factor.fixed);
    Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(size, -1, 2);
    for (const int unknown : factor.fixed) right[unknown] = 0;
    const Eigen::VectorXd expected = Eigen::PartialPivLU<Eigen::MatrixXd>(whole).solve(right);
    Eigen::VectorXd found = right;
    tangent.solve_in_place(found, Eigen::VectorXd(0));
    EXPECT_LT((found - expected).norm(), 1e-7 * expected.norm()) << moment.transpose();

    const Eigen::VectorXcd values =
        Eigen::PartialPivLU<Eigen::MatrixXd>(weighed).solve(whole).eigenvalues();
    const auto negative = static_cast<int>((values.real().array() < 0).count());
    EXPECT_EQ(tangent.unstable({material, diagonal}), negative) << moment.transpose();
    EXPECT_GE(negative, least_unstable) << moment.transpose();
  }
}

TEST(MomentTangent, SolvesAndCountsAsTheMatrixWrittenOut) {
  const LinkageModel model = rod(5);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  ASSERT_TRUE(equilibrium.solve(state, rolled(0.2)).converged());
  const double turn = 2 * std::numbers::pi * kBending;
  check_tangent(model, state, {{0, 0, 0}, {1, -0.2 * turn, 3}, {1, 3 * turn, 3}, {0, 0, 20}}, 0);

  LinkageState strut(model);
  Conditions pressed = clamped();
  const double euler = std::pow(std::numbers::pi / 2, 2) * kBending;
  pressed.loads = {{1, {-12 * euler, 0, 0}, {0, 0, 0}, 0}};
  EquilibriumOptions options;
  options.max_escapes = 0;
  ASSERT_EQ(equilibrium.solve(strut, pressed, options).status, EquilibriumStatus::kSaddle);
  check_tangent(model, strut, {{0, 0, 0}, {1e-3, 0, 0}, {turn, 0, 0}, {1, turn, 1}}, 2);
}

/// A moment of fixed direction at the end has one equilibrium, the arc: the moment is the same all
/// along the rod. From a quarter of a turn on the symmetric part of the tangent is indefinite.
TEST(EndMoment, RollsARodToAnArcBeyondAQuarterOfATurn) {
  const LinkageModel model = rod(20);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held = clamped();
  for (const double turns : {0.2, 0.25, 0.3, 0.45, 0.6}) {
    const Conditions to = rolled(turns);
    const DeploymentReport report = deploy(equilibrium, state, held, to);
    ASSERT_EQ(report.status, DeploymentStatus::kReached) << turns << ": " << report.message;
    EXPECT_TRUE(report.end.converged());
    EXPECT_EQ(report.end.negative_eigenvalues, 0) << turns;
    EXPECT_LT((state.joints()[1].position - end_of_arc(turns)).norm(), 2e-3) << turns;
    EXPECT_NEAR(report.end.energies.bending,
                0.5 * kBending * std::pow(2 * std::numbers::pi * turns, 2),
                1e-3 * report.end.energies.bending)
        << turns;
    held = to;
  }
}

TEST(EndMoment, BeyondAQuarterOfATurnItIsAlsoFoundAtOnceFromNearby) {
  const LinkageModel model = rod(20);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  for (const double turns : {0.08, 0.16, 0.24})
    ASSERT_TRUE(equilibrium.solve(state, rolled(turns)).converged()) << turns;
  const EquilibriumReport report = equilibrium.solve(state, rolled(0.27));
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT((state.joints()[1].position - end_of_arc(0.27)).norm(), 2e-3);
}

/// The only equilibrium is the arc, in the plane of the moment, however often it winds around. Slow
/// motions beside it come back, although the symmetric part of the tangent has lost definiteness.
TEST(EndMoments, ArcForAnyNumberOfTurns) {
  const LinkageModel model = rod(20);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held = clamped();
  for (const double turns : {0.25, 0.5, 1.0, 1.5, 2.0, 3.0}) {
    const Conditions to = rolled(turns);
    const DeploymentReport report = deploy(equilibrium, state, held, to);
    ASSERT_EQ(report.status, DeploymentStatus::kReached) << turns << ": " << report.message;
    EXPECT_TRUE(report.end.converged());
    // Its message says what is judged where the symmetric part is not definite.
    EXPECT_EQ(report.end.is_minimum, turns < 0.5) << turns;
    EXPECT_EQ(report.message == "reached", turns < 0.5) << turns;
    EXPECT_EQ(report.branchings + report.limit_points + report.jumps, 0) << turns;
    EXPECT_EQ(report.end.negative_eigenvalues, 0) << turns;
    const double angle = 2 * std::numbers::pi * turns;  // M L / (E I)
    EXPECT_LT((state.joints()[1].position - end_of_arc(turns)).norm(), 1e-3 * angle) << turns;
    EXPECT_LT(std::abs(state.joints()[1].position.y()), 1e-6) << turns;
    EXPECT_NEAR(report.end.energies.bending, 0.5 * kBending * angle * angle,
                1e-3 * report.end.energies.bending)
        << turns;
    EXPECT_LT(report.end.energies.twisting, 1e-9 * report.end.energies.bending) << turns;
    held = to;
  }
}

/// In one request, past where the symmetric part is singular, also for slender rods.
TEST(EndMoments, ArcInOneRequest) {
  for (const double turns : {0.5, 3.0}) {
    const LinkageModel model = rod(20, turns < 1 ? 1.2e7 : 2e4);
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    const DeploymentReport report = deploy(equilibrium, state, clamped(), rolled(turns));
    ASSERT_EQ(report.status, DeploymentStatus::kReached) << turns << ": " << report.message;
    EXPECT_EQ(report.end.negative_eigenvalues, 0) << turns;
    EXPECT_LT((state.joints()[1].position - end_of_arc(turns)).norm(), 2e-3) << turns;
  }
}

/// A strip is an arc about the compliant axis of its section. About the stiff one the arc is lost
/// somewhere (at 1.3 turns where that is 4 times as stiff, at 0.26 where it is 20 times): then the
/// answer says that it has not got there.
TEST(EndMoments, AStripIsAnArcOrSaysThatItIsNotThere) {
  for (const double across : {20 * kBending, 4 * kBending, kBending / 4, kBending / 20}) {
    const bool is_compliant = across > kBending;
    const LinkageModel model = rod(20, 2e4, across);
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    Conditions held = clamped();
    double reached = 0;
    for (const double turns : {0.1, 0.2, 1.0, 2.0}) {
      const Conditions to = rolled(turns);
      const DeploymentReport report = deploy(equilibrium, state, held, to);
      if (report.status != DeploymentStatus::kReached) {
        EXPECT_NE(report.message, "reached");
        break;
      }
      const double angle = 2 * std::numbers::pi * turns;
      EXPECT_LT((state.joints()[1].position - end_of_arc(turns)).norm(), 2e-3 * angle)
          << across << " " << turns << ": " << report.message;
      reached = turns;
      held = to;
    }
    EXPECT_GE(reached, is_compliant ? 2.0 : 0.2) << across;
  }
}

/// A moment about the rod's axis twists it by M L / (G J), and leaves it straight.
TEST(EndMoments, TwistForAnyNumberOfTurns) {
  const LinkageModel model = rod(20);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held = clamped();
  for (const double turns : {0.25, 0.5, 1.0, 2.0, 3.0}) {
    const double angle = 2 * std::numbers::pi * turns;
    Conditions to = clamped();
    to.loads = {{1, {0, 0, 0}, {angle * kTorsion, 0, 0}, 0}};
    const DeploymentReport report = deploy(equilibrium, state, held, to);
    ASSERT_EQ(report.status, DeploymentStatus::kReached) << turns << ": " << report.message;
    EXPECT_TRUE(report.end.converged());
    EXPECT_LT((state.joints()[1].position - Eigen::Vector3d(1, 0, 0)).norm(), 1e-6) << turns;
    EXPECT_NEAR(report.end.energies.twisting, 0.5 * kTorsion * angle * angle,
                1e-6 * report.end.energies.twisting)
        << turns;
    const Eigen::Vector3d normal(0, -std::sin(angle), std::cos(angle));
    EXPECT_LT((state.joints()[1].normal - normal).norm(), 1e-6) << turns;
    held = to;
  }
}

/// A strut over its buckling load is a saddle, with a small moment about its axis as without.
TEST(EndMoment, DoesNotHideThatAStrutBuckles) {
  const LinkageModel model = rod(20);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions = clamped();
  const double euler = std::pow(std::numbers::pi / 2, 2) * kBending;
  conditions.loads = {{1, {-1.2 * euler, 0, 0}, {1e-3, 0, 0}, 0}};
  EquilibriumOptions options;
  options.max_escapes = 0;
  const EquilibriumReport straight = equilibrium.solve(state, conditions, options);
  EXPECT_EQ(straight.status, EquilibriumStatus::kSaddle) << straight.message;
  EXPECT_GE(straight.negative_eigenvalues, 1);
}

}  // namespace
}  // namespace limber::rods
