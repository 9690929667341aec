// Exact constraints that depend on each other, targets out of reach, very short and very long time
// lines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/dense.h"

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/literal_spacetime.h"
#include "tests/support/two_link_arm.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using ::testing::HasSubstr;
using testing::LinearKinematics;
using testing::LiteralSpacetime;
using testing::TwoLinkArm;

SolveReport solve_all(Solver& solver, const std::vector<PositionConstraint>& constraints) {
  for (const auto& constraint : constraints) solver.add(constraint);
  return solver.solve();
}

TEST(ExactConstraints, AreHeldByANonlinearBody) {
  const auto kinematics = std::make_shared<ChainKinematics>(9, 8, 1.0, 2.0, 3);
  const Timeline timeline{80};
  const auto constraints = test_constraints(*kinematics, 6, timeline, 0.3, kExact, 41);
  Solver solver(kinematics, test_dynamics(9, 40, 0.01), timeline);
  const SolveReport report = solve_all(solver, constraints);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_LE(report.max_exact_error, 1e-8 * kinematics->length());
  EXPECT_FALSE(report.rank_deficient);
  EXPECT_EQ(report.constraint_energy, 0);
  EXPECT_GT(report.force_energy, 0);

  // Soft rows of growing weight approach exact ones from below.
  Solver soft(kinematics, test_dynamics(9, 40, 0.01), timeline);
  auto heavy = constraints;
  for (auto& constraint : heavy) constraint.weight = 1e6;
  const SolveReport near = solve_all(soft, heavy);
  EXPECT_LE(near.total_energy, report.total_energy * (1 + 1e-9));
  EXPECT_NEAR(near.total_energy, report.total_energy, 1e-3 * report.total_energy);
}

// A penalty of 1e7 takes off next to nothing of rows that only stiff modes move: what is left of
// them has a step of its own.
TEST(ExactConstraints, AreMetWhereOnlyStiffModesMoveThem) {
  const auto kinematics =
      std::make_shared<const LinearKinematics>(LinearKinematics::translation(1.0));
  ModeDynamics dynamics = test_dynamics(3, 40, 0.1);
  for (const double stiffness : {1e4, 1e5, 1e6}) {
    dynamics.stiffness[2] = stiffness;
    Solver solver(kinematics, dynamics, {80});
    SolveReport report;
    for (int frame = 10; frame < 60; ++frame) {
      const Eigen::Vector3d there(0.3, 0.1 * std::sin(0.1 * frame), 1e-3 * std::cos(0.2 * frame));
      solver.add({static_cast<ConstraintId>(frame), frame, 0, 7, there, kExact});
    }
    report = solver.solve();
    EXPECT_EQ(report.status, SolveStatus::kConverged) << stiffness << report.message;
    EXPECT_LE(report.max_exact_error, 1e-8) << stiffness;
    EXPECT_LE(report.iterations, 150) << stiffness;
  }
}

TEST(ExactConstraints, RedundantOnesChangeNothingAndAreCounted) {
  const auto kinematics = std::make_shared<ChainKinematics>(9, 8, 1.0, 2.0, 3);
  const Timeline timeline{80};
  auto constraints = test_constraints(*kinematics, 5, timeline, 0.3, kExact, 42);
  Solver once(kinematics, test_dynamics(9, 40, 0.01), timeline);
  const SolveReport reference = solve_all(once, constraints);
  for (int copy = 0; copy < 2; ++copy) {
    PositionConstraint same = constraints[2];
    same.id = 100 + static_cast<ConstraintId>(copy);
    constraints.push_back(same);
  }
  Solver twice(kinematics, test_dynamics(9, 40, 0.01), timeline);
  const SolveReport report = solve_all(twice, constraints);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_TRUE(report.rank_deficient);
  EXPECT_EQ(report.dependent_rows, 6);
  EXPECT_THAT(report.message, HasSubstr("6 exact"));
  EXPECT_LE(report.max_exact_error, 1e-8 * kinematics->length());
  EXPECT_NEAR(report.total_energy, reference.total_energy, 1e-7 * reference.total_energy);
  EXPECT_LE((twice.motion() - once.motion()).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(ExactConstraints, ContradictoryOnesEndAtTheLeastSquaresAnswer) {
  const auto kinematics = std::make_shared<ChainKinematics>(9, 8, 1.0, 2.0, 3);
  const Timeline timeline{80};
  auto constraints = test_constraints(*kinematics, 5, timeline, 0.3, kExact, 43);
  // Two wishes for one site in one frame: least squares holds it in the middle.
  auto middle = constraints;
  PositionConstraint other = constraints[2];
  other.id = 100;
  other.target += Eigen::Vector3d(0.1, -0.06, 0.08);
  constraints.push_back(other);
  middle[2].target += 0.5 * Eigen::Vector3d(0.1, -0.06, 0.08);
  Solver wished(kinematics, test_dynamics(9, 40, 0.01), timeline);
  const SolveReport report = solve_all(wished, constraints);
  Solver held(kinematics, test_dynamics(9, 40, 0.01), timeline);
  const SolveReport reference = solve_all(held, middle);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_TRUE(report.rank_deficient);
  EXPECT_EQ(report.dependent_rows, 3);
  EXPECT_THAT(report.message, HasSubstr("least-squares"));
  EXPECT_NEAR(report.max_exact_error, 0.5 * Eigen::Vector3d(0.1, -0.06, 0.08).norm(), 1e-6);
  EXPECT_NEAR(report.force_energy, reference.force_energy, 1e-5 * reference.force_energy);
  EXPECT_LE((wished.motion() - held.motion()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(ExactConstraints, MoreAxesThanModesInOneFrame) {
  // Two modes, three sites held in one frame: nine equations for two unknowns.
  const auto kinematics = std::make_shared<LinearKinematics>(2, 3, 1.0, 44);
  std::vector<PositionConstraint> constraints = linear_constraints(*kinematics, 3, 40, kExact, 45);
  Eigen::VectorXd wanted(9);
  for (std::size_t i = 0; i < 3; ++i) {
    constraints[i].frame = 17;
    wanted.segment<3>(3 * static_cast<Eigen::Index>(i)) = constraints[i].target;
  }
  const Eigen::VectorXd best = reference::ThinQr(kinematics->maps()).least_squares(wanted);
  Solver solver(kinematics, test_dynamics(2, 20, 0.01), {40});
  const SolveReport report = solve_all(solver, constraints);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_TRUE(report.rank_deficient);
  EXPECT_EQ(report.dependent_rows, 7);
  // What is left of the contradiction, times the heavy weight, hides smaller errors.
  EXPECT_LE((solver.motion().col(17) - best).norm(), 1e-5 * best.norm());
}

TEST(ExactConstraints, InAPinnedFrameAreReportedAsOutOfReach) {
  const auto kinematics = std::make_shared<LinearKinematics>(3, 1, 1.0, 46);
  Solver solver(kinematics, test_dynamics(3, 20, 0.01), {40});
  PositionConstraint constraint;
  constraint.id = 1;
  constraint.frame = 0;
  constraint.weight = kExact;
  constraint.target = {0.25, 0, 0};
  solver.add(constraint);
  const SolveReport report = solver.solve();
  EXPECT_TRUE(report.rank_deficient);
  EXPECT_NEAR(report.max_exact_error, 0.25, 1e-12);
  EXPECT_FALSE(report.message.empty());
  EXPECT_EQ(solver.motion().cwiseAbs().maxCoeff(), 0);
}

/// A chain of length 2 cannot reach 20 away; its motion must stay finite and be a minimum: what
/// Gauss-Newton on all frames, started there, cannot lower.
TEST(TargetsTenBodyLengthsAway, SoftConstraintsEndAtAMinimum) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{60};
  auto constraints = test_constraints(*kinematics, 4, timeline, 0.3, 1.0, 47);
  for (std::size_t i = 0; i < constraints.size(); ++i)
    constraints[i].target = 20 * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i % 3));
  const ModeDynamics dynamics = test_dynamics(6, 40, 0.01);
  Solver solver(kinematics, dynamics, timeline);
  const SolveReport report = solve_all(solver, constraints);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  ASSERT_TRUE(solver.motion().allFinite());
  LiteralSpacetime literal(kinematics, dynamics, timeline, constraints);
  EXPECT_NEAR(report.total_energy,
              literal.force_energy(solver.motion()) + literal.constraint_energy(solver.motion()),
              1e-9 * report.total_energy);
  const double rest = literal.constraint_energy(Eigen::MatrixXd::Zero(6, 60));
  EXPECT_LT(report.total_energy, rest);
  EXPECT_GE(literal.solve_from(solver.motion()).total_energy, (1 - 1e-8) * report.total_energy);
}

TEST(TargetsTenBodyLengthsAway, OfAnArmThatCannotStretch) {
  const auto arm = std::make_shared<TwoLinkArm>();
  PositionConstraint far;
  far.frame = 20;
  far.id = 1;
  far.axes = 3;
  far.target = {-1, 10, 0};
  for (const double weight : {100.0, PositionConstraint::kExact}) {
    far.weight = weight;
    Solver solver(arm, test_dynamics(2, 30, 0.01), {40});
    solver.add(far);
    const SolveReport report = solver.solve();
    ASSERT_TRUE(solver.motion().allFinite());
    ASSERT_TRUE(std::isfinite(report.total_energy));
    EXPECT_NEAR(report.max_constraint_error, 9, 0.1) << weight;
    // Pointing straight at the target: both links upright.
    const double first = solver.motion()(0, 20), second = solver.motion()(1, 20);
    EXPECT_NEAR(std::sin(first), 1, 0.05) << weight;
    EXPECT_NEAR(std::sin(first + second), 1, 0.05) << weight;
    if (weight == 100.0) {
      EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
      LiteralSpacetime literal(arm, test_dynamics(2, 30, 0.01), {40}, {far});
      EXPECT_LE(literal.gradient(solver.motion()).cwiseAbs().maxCoeff(), 1e-5);
    } else {
      EXPECT_FALSE(report.message.empty());
      EXPECT_TRUE(report.status != SolveStatus::kConverged || report.rank_deficient);
    }
  }
}

TEST(TargetsTenBodyLengthsAway, ExactConstraintsAreMetByStretching) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{60};
  auto constraints = test_constraints(*kinematics, 2, timeline, 0.3, kExact, 48);
  for (auto& constraint : constraints) constraint.target = {20, 0, 0};
  SolverOptions options;
  options.max_iterations = 2000;  // many for a method that trusts its linear model
  Solver solver(kinematics, test_dynamics(6, 40, 0.01), timeline, options);
  const SolveReport report = solve_all(solver, constraints);
  // The links of the chain stretch without limit, at a cost.
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_TRUE(solver.motion().allFinite());
  EXPECT_LE(report.max_exact_error, 1e-8 * kinematics->length());
  EXPECT_GT(report.force_energy, 1);
  // Targets that can be reached again are reached again.
  for (auto& constraint : test_constraints(*kinematics, 2, timeline, 0.3, kExact, 48)) {
    solver.replace(constraint);
  }
  solver.cold_start();
  const SolveReport back = solver.solve();
  EXPECT_EQ(back.status, SolveStatus::kConverged) << back.message;
  EXPECT_LE(back.max_exact_error, 1e-7);
}

class ShortTimelines : public ::testing::TestWithParam<int> {};

TEST_P(ShortTimelines, AllEndsThatLeaveAFreeFrame) {
  const int frames = GetParam();
  const LinearKinematics kinematics(3, 2, 1.0, 49);
  const ModeDynamics dynamics = test_dynamics(3, 10, 0.02);
  int solved = 0;
  for (int first = 0; first <= 2; ++first) {
    for (int last = 0; last <= 2; ++last) {
      const Timeline timeline{frames, static_cast<EndCondition>(first),
                              static_cast<EndCondition>(last)};
      if (first + last >= frames) {
        EXPECT_THROW(Solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline),
                     Error);
        continue;
      }
      auto constraints = linear_constraints(kinematics, 2, 8, 30, 50);
      constraints[0].frame = first;
      constraints[1].frame = frames - 1 - last;
      constraints[1].site = 1 - constraints[0].site;
      Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline);
      const SolveReport report = solve_all(solver, constraints);
      const DenseAnswer dense = dense_optimum(kinematics, dynamics, timeline, constraints);
      EXPECT_EQ(report.status, SolveStatus::kConverged) << first << last << report.message;
      // Both ends free leave a reachable target without cost: compare with what z = 0 costs.
      double rest = 0;
      for (const auto& constraint : constraints) rest += 15 * constraint.target.squaredNorm();
      EXPECT_NEAR(report.total_energy, dense.energy, 1e-9 * dense.energy + 1e-14 * rest)
          << first << last;
      ++solved;
    }
  }
  EXPECT_EQ(solved, frames == 3 ? 6 : 8);
}

INSTANTIATE_TEST_SUITE_P(Frames, ShortTimelines, ::testing::Values(3, 4),
                         ::testing::PrintToStringParamName());

TEST(LongTimelines, TenThousandFramesAgreeWithTheLiteralMethod) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{10000};
  const auto constraints = test_constraints(*kinematics, 12, timeline, 0.3, 10, 51);
  const ModeDynamics dynamics = test_dynamics(6, 200, 0.01);
  Solver solver(kinematics, dynamics, timeline);
  const SolveReport report = solve_all(solver, constraints);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  LiteralSpacetime literal(kinematics, dynamics, timeline, constraints);
  const double energy =
      literal.force_energy(solver.motion()) + literal.constraint_energy(solver.motion());
  EXPECT_NEAR(report.total_energy, energy, 1e-8 * energy);
  const auto reference = literal.solve_from(solver.motion());
  EXPECT_NEAR(reference.total_energy, report.total_energy, 1e-7 * report.total_energy);
}

}  // namespace
}  // namespace limber::spacetime
