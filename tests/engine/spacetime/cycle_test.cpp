// Cyclic ends: no frame is the first one.
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "engine/spacetime/fit_dynamics.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/scenes.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;

constexpr int kCycleFrames = 48;
constexpr double kSameMotion = 1e-6;  // body lengths, as the shown motion may differ

Timeline cycle(int frames) { return {frames, EndCondition::kCyclic, EndCondition::kCyclic}; }

/// Sampled modes with smooth forces, and the published form.
std::vector<ModeDynamics> forms(double damping_ratio, int modes = 6) {
  ModeDynamics published = test_dynamics(modes, 30, damping_ratio), calm = published;
  calm.discretisation = Discretisation::kSampled;
  calm.smoothing = 6;
  return {published, calm};
}

int turned(int frame, int by) { return (frame + by) % kCycleFrames; }

/// The same constraints `by` frames later, around the seam.
std::vector<PositionConstraint> turned(std::vector<PositionConstraint> constraints, int by) {
  for (PositionConstraint& constraint : constraints) {
    const int frame = turned(constraint.frame, by);
    if (constraint.since) constraint.since = turned(*constraint.since, by);
    constraint.frame = frame;
  }
  return constraints;
}

Eigen::MatrixXd turned(const Eigen::MatrixXd& motion, int by) {
  Eigen::MatrixXd result(motion.rows(), motion.cols());
  for (int frame = 0; frame < motion.cols(); ++frame)
    result.col(turned(frame, by)) = motion.col(frame);
  return result;
}

Solver solver_of(const std::shared_ptr<const reduced::Kinematics>& body,
                 const ModeDynamics& dynamics, const std::vector<PositionConstraint>& constraints) {
  Solver solver(body, dynamics, cycle(kCycleFrames));
  for (const PositionConstraint& constraint : constraints) solver.add(constraint);
  return solver;
}

std::vector<PositionConstraint> bending_constraints(const ChainKinematics& chain, double weight) {
  auto constraints = test_constraints(chain, 4, cycle(kCycleFrames), 0.4, weight, 5);
  constraints[2].since = constraints[2].frame - 2;
  constraints[2].target *= 0.05;
  return constraints;
}

TEST(Cycle, ABendingMotionDoesNotDependOnItsSeam) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  for (const double weight : {100.0, kExact}) {
    const auto constraints = bending_constraints(*chain, weight);
    for (const ModeDynamics& dynamics : forms(0.2)) {
      Solver first = solver_of(chain, dynamics, constraints);
      const SolveReport report = first.solve();
      ASSERT_EQ(report.status, SolveStatus::kConverged) << report.message;
      EXPECT_GT(first.motion().cwiseAbs().maxCoeff(), 0.1);
      EXPECT_NEAR(report.force_energy, force_energy(dynamics, first.motion(), Beginning::kCyclic),
                  1e-8 * report.total_energy);
      // Velocities over the seam, knots in the first and the last frame, none beside the seam.
      for (const int by : {1, kCycleFrames - constraints[2].frame,
                           kCycleFrames - 1 - constraints[2].frame, 17, 30}) {
        Solver later = solver_of(chain, dynamics, turned(constraints, by));
        ASSERT_EQ(later.solve().status, SolveStatus::kConverged);
        EXPECT_LE((later.motion() - turned(first.motion(), by)).cwiseAbs().maxCoeff(), kSameMotion)
            << "turned by " << by;
      }
    }
  }
}

TEST(Cycle, TheLastFrameLeadsIntoTheFirst) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  const ModeDynamics calm = forms(0.7)[1];
  Solver solver = solver_of(chain, calm, bending_constraints(*chain, kExact));
  ASSERT_EQ(solver.solve().status, SolveStatus::kConverged);
  // Two turns one after the other: the forces at the seam are no larger than elsewhere.
  const Eigen::MatrixXd z = solver.motion();
  Eigen::MatrixXd twice(z.rows(), 2 * z.cols());
  twice << z, z;
  double at_seam = 0, anywhere = 0;
  for (int frame = 1; frame + 1 < twice.cols(); ++frame) {
    for (Eigen::Index k = 0; k < z.rows(); ++k) {
      const ForceStencil stencil = force_stencil(calm, k);
      const double force = stencil.before * twice(k, frame - 1) + stencil.centre * twice(k, frame) +
                           stencil.next * twice(k, frame + 1);
      anywhere = std::max(anywhere, std::abs(force));
      if (frame == kCycleFrames - 1 || frame == kCycleFrames)
        at_seam = std::max(at_seam, std::abs(force));
    }
  }
  EXPECT_LT(at_seam, anywhere);
}

TEST(Cycle, APartOfAMotionIsThatOfTheWhole) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  for (const ModeDynamics& dynamics : forms(0.2)) {
    for (const int by : {0, 20, 40}) {
      const auto constraints = turned(bending_constraints(*chain, 100), by);
      Solver whole = solver_of(chain, dynamics, constraints);
      ASSERT_EQ(whole.solve().status, SolveStatus::kConverged);
      for (const FrameSpan span :
           {FrameSpan{0, 3}, FrameSpan{44, 4}, FrameSpan{10, 30}, FrameSpan{0, kCycleFrames}}) {
        Solver part = solver_of(chain, dynamics, constraints);
        ASSERT_EQ(part.solve().status, SolveStatus::kConverged);
        EXPECT_GE(part.frames_to_fill(span), 0);
        EXPECT_LE((part.motion_in(span) - whole.motion().middleCols(span.first, span.count))
                      .cwiseAbs()
                      .maxCoeff(),
                  1e-12);
      }
    }
  }
}

TEST(Cycle, EditsEndWhereAColdStartDoes) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  const ModeDynamics calm = forms(0.7)[1];
  const auto constraints = bending_constraints(*chain, 100);
  Solver warm(chain, calm, {kCycleFrames});
  for (const PositionConstraint& constraint : constraints) {
    if (!constraint.since) warm.add(constraint);
    warm.solve();
  }
  warm.set_timeline(EndCondition::kCyclic, EndCondition::kCyclic);
  warm.add(constraints[2]);
  const SolveReport report = warm.solve();
  ASSERT_EQ(report.status, SolveStatus::kConverged);
  Solver cold = solver_of(chain, calm, constraints);
  EXPECT_NEAR(report.total_energy, cold.solve().total_energy, 1e-8 * report.total_energy);
  // A constraint in a frame of its own splits a run over the seam, its removal merges two.
  PositionConstraint at_seam = constraints[0];
  at_seam.id = 99;
  for (const int frame : {0, kCycleFrames - 1, kCycleFrames - 2}) {
    at_seam.frame = frame;
    warm.add(at_seam);
    warm.solve();
    warm.remove(99);
  }
  EXPECT_NEAR(warm.solve().total_energy, report.total_energy, 1e-8 * report.total_energy);
}

TEST(Cycle, ManyNeighboursAndFewFrames) {
  const LinearKinematics body(3, 3, 1.0, 25);
  for (const ModeDynamics& dynamics : forms(0.05, 3)) {
    for (const int frames : {3, 4, 5, 7, 12}) {
      // In every frame one, but those of the mask.
      for (const unsigned without : {0U, 1U, 6U, 0x30U, 0x801U}) {
        std::vector<PositionConstraint> constraints;
        for (int frame = 0; frame < frames; ++frame) {
          if ((without >> frame & 1U) != 0) continue;
          PositionConstraint constraint =
              linear_constraints(body, 1, frames + 9, 30, 60U + static_cast<unsigned>(frame))[0];
          constraint.id = static_cast<ConstraintId>(frame + 1);
          constraint.frame = frame;
          constraint.site = frame % 3;
          constraints.push_back(constraint);
        }
        if (constraints.empty()) continue;
        const DenseAnswer dense = dense_optimum(body, dynamics, cycle(frames), constraints);
        Solver solver(std::make_shared<LinearKinematics>(body), dynamics, cycle(frames));
        for (const PositionConstraint& constraint : constraints) solver.add(constraint);
        const SolveReport report = solver.solve();
        EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
        EXPECT_NEAR(report.total_energy, dense.energy, 1e-9 * dense.energy);
        EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
                  1e-6 * dense.z.cwiseAbs().maxCoeff())
            << frames << " frames, without " << without;
      }
    }
  }
}

TEST(Cycle, OneConstraintAloneIsMetAsInTheDenseAnswer) {
  const LinearKinematics body(3, 3, 1.0, 25);
  for (const ModeDynamics& dynamics : forms(0.05, 3)) {
    auto constraints = linear_constraints(body, 1, 20, 100, 7);
    const DenseAnswer dense = dense_optimum(body, dynamics, cycle(20), constraints);
    Solver solver(std::make_shared<LinearKinematics>(body), dynamics, cycle(20));
    solver.add(constraints[0]);
    EXPECT_EQ(solver.solve().status, SolveStatus::kConverged);
    EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
              1e-6 * dense.z.cwiseAbs().maxCoeff());
  }
}

TEST(Cycle, FitsTakeForcesAroundTheSeam) {
  // A free swing that fits the cycle: no force acts in any frame.
  const double omega = 2 * 3.141592653589793 * 3 / kCycleFrames;
  Eigen::RowVectorXd z(kCycleFrames);
  for (int frame = 0; frame < kCycleFrames; ++frame) z[frame] = std::cos(omega * (frame + 0.3));
  FitOptions options{Discretisation::kSampled, 4};
  options.beginning = Beginning::kCyclic;
  EXPECT_NEAR(fit_mode(z, options).stiffness, omega * omega, 1e-6);
  options.discretisation = Discretisation::kDifferences;
  EXPECT_NEAR(fit_mode(z, options).stiffness, 2 - 2 * std::cos(omega), 1e-12);
}

TEST(Cycle, AMaterialFitLowersTheEnergy) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  const ModeDynamics calm = forms(0.2)[1];
  Solver solver = solver_of(chain, calm, bending_constraints(*chain, 100));
  const SolveReport before = solver.solve();
  ASSERT_EQ(before.status, SolveStatus::kConverged);
  MaterialOptions options;
  options.variables = MaterialVariables::kMotionAndDynamics;
  MaterialSolver fit(chain, solver.timeline(), solver.constraint_set(),
                     {calm, first_coordinates(6, 6)}, solver.motion(), options);
  const MaterialReport report = fit.solve();
  EXPECT_LT(report.total_energy, 0.9 * before.total_energy);
  EXPECT_NEAR(report.force_energy,
              force_energy(fit.material().dynamics, fit.motion(), Beginning::kCyclic),
              1e-8 * report.total_energy);
}

TEST(Cycle, IsOfBothEndsOrOfNone) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  const ModeDynamics calm = forms(0.7)[1];
  EXPECT_THROW(Solver(chain, calm, {20, EndCondition::kCyclic, EndCondition::kFree}), Error);
  EXPECT_THROW(Solver(chain, calm, {20, EndCondition::kFree, EndCondition::kCyclic}), Error);
  Solver solver(chain, calm, cycle(20));
  PositionConstraint constraint;
  constraint.id = 1;
  for (const int since : {-1, 0, 20}) {
    constraint.since = since;
    EXPECT_THROW(solver.add(constraint), Error);
  }
  constraint.since = 19;
  solver.add(constraint);
}

}  // namespace
}  // namespace limber::spacetime
