// Linear kinematics against a dense solve of the optimality conditions in long double.
#include <gtest/gtest.h>

#include <numbers>

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"

namespace limber::spacetime {
namespace {

using testing::LinearKinematics;

constexpr double kEnergyAccuracy = 1e-9, kMotionAccuracy = 1e-6;  // relative

/// The same problem without the frames beyond the outermost constraints at free ends, but the one
/// beside each: there A z = 0 can be met from any earlier motion, so nothing that costs is left
/// out, and what grows in those frames does not spoil the dense solve.
struct Trimmed {
  Timeline timeline;
  std::vector<PositionConstraint> constraints;
  int from = 0;  // frame 0 of the trimmed time line
};

Trimmed trim(const Timeline& timeline, const std::vector<PositionConstraint>& constraints) {
  Trimmed trimmed{timeline, constraints, 0};
  if (timeline.last == EndCondition::kFree)
    trimmed.timeline.frame_count = std::min(timeline.frame_count, constraints.back().frame + 2);
  if (timeline.first == EndCondition::kFree)
    trimmed.from = std::max(0, constraints.front().frame - 1);
  trimmed.timeline.frame_count -= trimmed.from;
  for (auto& constraint : trimmed.constraints) constraint.frame -= trimmed.from;
  return trimmed;
}

void expect_dense_answer(const LinearKinematics& kinematics, const ModeDynamics& dynamics,
                         const Timeline& timeline,
                         const std::vector<PositionConstraint>& constraints,
                         double motion_accuracy = kMotionAccuracy) {
  const DenseAnswer dense = dense_optimum(kinematics, dynamics, timeline, constraints);
  Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline);
  for (const auto& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_FALSE(report.rank_deficient) << report.message;
  EXPECT_NEAR(report.total_energy, dense.energy, kEnergyAccuracy * dense.energy);
  EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
            motion_accuracy * dense.z.cwiseAbs().maxCoeff());
  EXPECT_TRUE(solver.motion().allFinite());
  EXPECT_GT(dense.z.cwiseAbs().maxCoeff(), 0.01) << "nothing moves, nothing is tested";
}

ModeDynamics one_mode(double lambda, double damping) {
  return {Eigen::VectorXd::Constant(1, lambda), Eigen::VectorXd::Constant(1, damping)};
}

/// Exact rows must be independent: with one mode only one axis can be held in a frame.
std::vector<PositionConstraint> one_axis(std::vector<PositionConstraint> constraints) {
  for (std::size_t i = 0; i < constraints.size(); ++i) constraints[i].axes = 1U << (i % 3);
  return constraints;
}

TEST(SolverDense, SingleModeSoft) {
  const LinearKinematics kinematics(1, 2, 3.0, 7);
  for (const double weight : {1e-3, 1.0, 1e4}) {
    const auto constraints = linear_constraints(kinematics, 4, 40, weight, 11);
    expect_dense_answer(kinematics, one_mode(0.02, 0.01), {40}, constraints);
  }
}

TEST(SolverDense, SingleModeExact) {
  const LinearKinematics kinematics(1, 2, 3.0, 7);
  const auto constraints = one_axis(linear_constraints(kinematics, 4, 40, kExact, 12));
  expect_dense_answer(kinematics, one_mode(0.02, 0.01), {40}, constraints);
}

TEST(SolverDense, SingleModeSoftAndExactTogether) {
  const LinearKinematics kinematics(1, 2, 3.0, 7);
  auto constraints = one_axis(linear_constraints(kinematics, 5, 40, kExact, 13));
  constraints[1].weight = constraints[3].weight = 5;
  expect_dense_answer(kinematics, one_mode(0.02, 0.0), {40}, constraints);
}

TEST(SolverDense, ManyConstraintsInOneFrame) {
  const LinearKinematics kinematics(4, 5, 1.0, 8);
  auto constraints = linear_constraints(kinematics, 5, 24, 20, 14);
  for (auto& constraint : constraints) constraint.frame = 11;
  expect_dense_answer(kinematics, test_dynamics(4, 20, 0.02), {24}, constraints);
}

TEST(SolverDense, NeighbouringFrames) {
  const LinearKinematics kinematics(3, 2, 1.0, 9);
  auto constraints = linear_constraints(kinematics, 6, 24, 20, 15);
  for (std::size_t i = 0; i < constraints.size(); ++i)
    constraints[i].frame = 8 + static_cast<int>(i);
  expect_dense_answer(kinematics, test_dynamics(3, 20, 0.02), {24}, constraints);
}

class SolverDenseEnds : public ::testing::TestWithParam<Ends> {};

TEST_P(SolverDenseEnds, Soft) {
  const LinearKinematics kinematics(4, 3, 1.0, 21);
  const Timeline timeline{26, GetParam().first, GetParam().last};
  expect_dense_answer(kinematics, test_dynamics(4, 15, 0.02), timeline,
                      linear_constraints(kinematics, 5, 26, 100, 22));
}

TEST_P(SolverDenseEnds, Exact) {
  const LinearKinematics kinematics(4, 3, 1.0, 23);
  const Timeline timeline{26, GetParam().first, GetParam().last};
  expect_dense_answer(kinematics, test_dynamics(4, 15, 0.02), timeline,
                      linear_constraints(kinematics, 5, 26, kExact, 24));
}

TEST_P(SolverDenseEnds, ConstraintsInTheEndFrames) {
  const LinearKinematics kinematics(3, 3, 1.0, 25);
  const Timeline timeline{20, GetParam().first, GetParam().last};
  auto constraints = linear_constraints(kinematics, 6, 20, 10, 26);
  constraints[0].frame = 0;
  constraints[1].frame = 1;
  constraints[4].frame = 18;
  constraints[5].frame = 19;
  expect_dense_answer(kinematics, test_dynamics(3, 15, 0.02), timeline, constraints);
}

/// lambda > 4: the free recurrence z_(i+1) = (2 - lambda) z_i - z_(i-1) grows without bound.
TEST_P(SolverDenseEnds, HyperbolicModes) {
  const LinearKinematics kinematics(3, 3, 1.0, 27);
  const Timeline timeline{22, GetParam().first, GetParam().last};
  ModeDynamics dynamics = test_dynamics(3, 15, 0.0);
  dynamics.stiffness << 0.1, 5.0, 40.0;
  dynamics.damping << 0.0, 0.05, 0.2;
  const auto constraints = linear_constraints(kinematics, 5, 22, 100, 28);
  if (timeline.first != EndCondition::kFree && timeline.last != EndCondition::kFree) {
    return expect_dense_answer(kinematics, dynamics, timeline, constraints);
  }
  // At a free end such a mode is held at zero (NOTATION.md); the dense answer lets it go.
  Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline);
  for (const auto& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  const Trimmed problem = trim(timeline, constraints);
  const DenseAnswer dense =
      dense_optimum(kinematics, dynamics, problem.timeline, problem.constraints);
  EXPECT_GE(report.total_energy, (1 - kEnergyAccuracy) * dense.energy);
  const int from = constraints.front().frame, count = constraints.back().frame - from + 1;
  EXPECT_LE(solver.motion().cwiseAbs().maxCoeff(),
            4 * solver.motion().middleCols(from, count).cwiseAbs().maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(All, SolverDenseEnds, ::testing::ValuesIn(all_ends()),
                         ::testing::PrintToStringParamName());

TEST(SolverDense, StiffnessOfSevenDecades) {
  const LinearKinematics kinematics(3, 3, 1.0, 29);
  ModeDynamics dynamics = test_dynamics(3, 15, 0.0);
  dynamics.stiffness << 1e-4, 1.0, 1e3;
  for (const EndCondition first :
       {EndCondition::kPinnedPosition, EndCondition::kPinnedPositionVelocity}) {
    for (const EndCondition last :
         {EndCondition::kPinnedPosition, EndCondition::kPinnedPositionVelocity}) {
      expect_dense_answer(kinematics, dynamics, {18, first, last},
                          linear_constraints(kinematics, 5, 18, 100, 30));
    }
  }
}

/// With both ends pinned in position and lambda = 2 - 2 cos(pi m / (N - 1)), m swings cost nothing:
/// A_k has a null vector although nothing is free.
TEST(SolverDense, ResonantPinnedEnds) {
  constexpr int kFrames = 31;
  const LinearKinematics kinematics(2, 3, 1.0, 31);
  for (const double detuning : {0.0, 1e-9, 1e-5, -1e-3}) {
    ModeDynamics dynamics{Eigen::VectorXd(2), Eigen::VectorXd::Zero(2)};
    for (int k = 0; k < 2; ++k) {
      dynamics.stiffness[k] =
          (1 + detuning) * (2 - 2 * std::cos(std::numbers::pi * (k + 2) / (kFrames - 1)));
    }
    const Timeline timeline{kFrames, EndCondition::kPinnedPosition, EndCondition::kPinnedPosition};
    SCOPED_TRACE(detuning);
    expect_dense_answer(kinematics, dynamics, timeline,
                        linear_constraints(kinematics, 4, kFrames, 50, 32));
    expect_dense_answer(kinematics, dynamics, timeline,
                        one_axis(linear_constraints(kinematics, 4, kFrames, kExact, 33)));
  }
}

TEST(SolverDense, RigidAndElasticUnknownsTogether) {
  const LinearKinematics kinematics(6, 4, 2.0, 34);
  ModeDynamics dynamics = test_dynamics(6, 20, 0.02);
  dynamics.stiffness.head(3).setZero();
  dynamics.damping.head(3).setZero();
  for (const EndCondition end : kEnds) {
    const Timeline timeline{24, end, end};
    expect_dense_answer(kinematics, dynamics, timeline,
                        linear_constraints(kinematics, 6, 24, 100, 35));
  }
}

TEST(SolverDense, PartialAxes) {
  const LinearKinematics kinematics(5, 4, 1.0, 36);
  auto constraints = linear_constraints(kinematics, 7, 30, 100, 37);
  for (std::size_t i = 0; i < constraints.size(); ++i)
    constraints[i].axes = static_cast<unsigned>(i + 1);
  expect_dense_answer(kinematics, test_dynamics(5, 20, 0.01), {30}, constraints);
}

}  // namespace
}  // namespace limber::spacetime
