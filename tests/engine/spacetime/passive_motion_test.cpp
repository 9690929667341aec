#include "engine/spacetime/passive_motion.h"

#include <gtest/gtest.h>

#include <memory>

#include "engine/spacetime/material.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;

constexpr int kCarriedFrames = 40;

ModeDynamics carried(double smoothing, double damping_ratio = 0.1) {
  ModeDynamics dynamics = test_dynamics(4, 20, damping_ratio);
  dynamics.discretisation = Discretisation::kSampled;
  dynamics.smoothing = smoothing;
  return dynamics;
}

Eigen::MatrixXd random_load(unsigned seed) {
  std::mt19937_64 generator(seed);
  Eigen::MatrixXd load(4, kCarriedFrames);
  for (auto& value : load.reshaped()) value = 0.01 * testing::uniform(generator);
  return load;
}

/// A over all free frames and B g, by the definition, in long double.
struct DenseLoaded {
  DenseMatrix rows;
  DenseVector load;
};

DenseLoaded dense_loaded(const ModeDynamics& dynamics, Eigen::Index mode, const Timeline& timeline,
                         const Eigen::MatrixXd& load) {
  const Eigen::Index frames = timeline.frame_count;
  const bool is_cyclic = timeline.is_cyclic();
  DenseLoaded made{
      is_cyclic ? dense_cycle(dynamics, mode, frames) : dense_forces(dynamics, mode, frames), {}};
  made.load = DenseVector::Zero(made.rows.rows());
  const Real tau = dynamics.smoothing;
  const Eigen::Index count = is_cyclic ? frames : frames - 2;
  const auto of = [&](Eigen::Index i) -> Real {
    if (is_cyclic) return load(mode, (i % frames + frames) % frames);
    return i < 0 || i >= count ? 0 : load(mode, i + 1);
  };
  for (Eigen::Index i = 0; i < count; ++i) made.load[i] = of(i);
  if (is_cyclic) {
    for (Eigen::Index i = 0; i < frames; ++i) made.load[frames + i] = tau * (of(i + 1) - of(i));
  } else {
    for (Eigen::Index i = 0; i <= count; ++i) made.load[count + i] = tau * (of(i) - of(i - 1));
  }
  return made;
}

class PassiveMotionEnds : public ::testing::TestWithParam<Ends> {};

TEST_P(PassiveMotionEnds, IsTheLeastSquaresOfTheDefinition) {
  const Timeline timeline{kCarriedFrames, GetParam().first, GetParam().last};
  const FreeFrames free(timeline);
  for (const double smoothing : {0.0, 5.0}) {
    const ModeDynamics dynamics = carried(smoothing);
    const Eigen::MatrixXd load = random_load(3);
    const PassiveMotion passive = passive_motion(dynamics, timeline, load);
    Real energy = 0;
    for (Eigen::Index k = 0; k < 4; ++k) {
      const DenseLoaded dense = dense_loaded(dynamics, k, timeline, load);
      const DenseMatrix rows = dense.rows.middleCols(free.first(), free.count());
      const DenseVector z = reference::least_squares_in_long_double(rows, dense.load);
      energy += (rows * z - dense.load).squaredNorm() / 2;
      EXPECT_LE(
          (passive.z.row(k).segment(free.first(), free.count()).transpose() - z.cast<double>())
              .cwiseAbs()
              .maxCoeff(),
          1e-8 * passive.z.cwiseAbs().maxCoeff());
    }
    EXPECT_NEAR(passive.energy, static_cast<double>(energy),
                1e-9 * load.squaredNorm() * (1 + smoothing * smoothing));
    EXPECT_GT(passive.z.cwiseAbs().maxCoeff(), 1e-3);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PassiveMotionEnds, ::testing::ValuesIn(all_ends()),
                         ::testing::PrintToStringParamName());

/// z'' + d z' + lambda z = g is what happens between free ends: nothing else costs.
TEST(PassiveMotion, NeedsNoControlForcesBetweenFreeEnds) {
  const Timeline timeline{kCarriedFrames, EndCondition::kFree, EndCondition::kFree};
  const Eigen::MatrixXd load = random_load(4);
  const ModeDynamics dynamics = carried(0);
  const PassiveMotion passive = passive_motion(dynamics, timeline, load);
  EXPECT_LT(passive.energy, 1e-12 * load.squaredNorm());
  for (Eigen::Index k = 0; k < 4; ++k) {
    const ForceStencil stencil = force_stencil(dynamics, k);
    for (int i = 1; i + 1 < kCarriedFrames; ++i) {
      EXPECT_NEAR(stencil.before * passive.z(k, i - 1) + stencil.centre * passive.z(k, i) +
                      stencil.next * passive.z(k, i + 1),
                  load(k, i), 1e-9);
    }
  }
}

TEST(PassiveMotion, AConstantLoadBendsACycleByItsStaticDisplacement) {
  const Timeline timeline{kCarriedFrames, EndCondition::kCyclic, EndCondition::kCyclic};
  const ModeDynamics dynamics = carried(5);
  const Eigen::MatrixXd load = Eigen::MatrixXd::Constant(4, kCarriedFrames, 0.01);
  const PassiveMotion passive = passive_motion(dynamics, timeline, load);
  for (Eigen::Index k = 0; k < 4; ++k)
    for (int i = 0; i < kCarriedFrames; ++i)
      EXPECT_NEAR(passive.z(k, i), 0.01 / dynamics.stiffness[k], 1e-9);
}

/// Without constraints the motion is the passive one, with them the optimum over all motions.
TEST(PassiveMotion, IsWhatASolverWithALoadAddsTo) {
  const auto chain = std::make_shared<ChainKinematics>(4, 8, 1.0, 2.0, 3);
  for (const Ends ends : all_ends()) {
    const Timeline timeline{kCarriedFrames, ends.first, ends.last};
    const ModeDynamics dynamics = carried(4);
    const Eigen::MatrixXd load = random_load(5);
    const PassiveMotion passive = passive_motion(dynamics, timeline, load);
    Solver solver(chain, dynamics, timeline);
    solver.set_load(load);
    SolveReport report = solver.solve();
    EXPECT_EQ(report.status, SolveStatus::kConverged);
    EXPECT_LE((solver.motion() - passive.z).cwiseAbs().maxCoeff(), 1e-12);
    const auto constraints = test_constraints(*chain, 4, timeline, 0.4, 100, 5);
    for (const auto& constraint : constraints) solver.add(constraint);
    report = solver.solve();
    ASSERT_EQ(report.status, SolveStatus::kConverged) << report.message;
    const auto energy_of = [&](const Eigen::MatrixXd& z) {
      Real energy = 0;
      for (Eigen::Index k = 0; k < 4; ++k) {
        const DenseLoaded dense = dense_loaded(dynamics, k, timeline, load);
        energy += (dense.rows * z.row(k).transpose().cast<Real>() - dense.load).squaredNorm() / 2;
      }
      return static_cast<double>(energy) + soft_energy(*chain, constraints, z);
    };
    const double energy = energy_of(solver.motion());
    EXPECT_NEAR(report.total_energy, energy, 1e-8 * energy);
    const FreeFrames free(timeline);
    std::mt19937_64 generator(9);
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::MatrixXd moved = solver.motion();
      for (int i = free.first(); i <= free.last(); ++i)
        for (Eigen::Index k = 0; k < moved.rows(); ++k)
          moved(k, i) += 1e-4 * testing::uniform(generator);
      EXPECT_GT(energy_of(moved), energy);
    }
    // Taken away again, it is as if it had never been there.
    solver.set_load({});
    Solver without(chain, dynamics, timeline);
    for (const auto& constraint : constraints) without.add(constraint);
    EXPECT_NEAR(solver.solve().total_energy, without.solve().total_energy, 1e-8 * energy);
  }
}

TEST(PassiveMotion, RefusesALoadOfAnotherShape) {
  const auto chain = std::make_shared<ChainKinematics>(4, 8, 1.0, 2.0, 3);
  Solver solver(chain, carried(0), {kCarriedFrames});
  EXPECT_THROW(solver.set_load(Eigen::MatrixXd::Zero(3, kCarriedFrames)), Error);
  EXPECT_THROW(solver.set_load(Eigen::MatrixXd::Zero(4, 3)), Error);
  EXPECT_THROW(solver.set_load(Eigen::MatrixXd::Constant(4, kCarriedFrames, std::nan(""))), Error);
}

}  // namespace
}  // namespace limber::spacetime
