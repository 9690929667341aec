// Material fits and recoveries of sampled modes.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "engine/spacetime/fit_dynamics.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/recovery_energy.h"
#include "engine/spacetime/recovery_swings.h"
#include "tests/engine/spacetime/recovery_problems.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/energy_conformance.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;

/// A bending chain led through targets with modes of which most are fast, forces smoothed.
struct SampledScene {
  explicit SampledScene(double ratio) {
    chain = std::make_shared<ChainKinematics>(10, 8, 1.0, 2.0, 3);
    timeline.frame_count = 80;
    for (const auto& constraint : test_constraints(*chain, 6, timeline, 0.5, 100, 5))
      constraints.positions[constraint.id] = constraint;
    material = {test_dynamics(4, 12, ratio), first_coordinates(10, 4)};
    material.dynamics.discretisation = Discretisation::kSampled;
    material.dynamics.smoothing = 4;
    Solver solver(chain, material.dynamics, timeline, {}, material.mixing);
    for (const auto& [id, constraint] : constraints.positions) solver.add(constraint);
    forces_alone = solver.solve();
    motion = solver.motion();
  }

  std::shared_ptr<ChainKinematics> chain;
  Timeline timeline;
  ConstraintSet constraints;
  Material material;
  Eigen::MatrixXd motion;
  SolveReport forces_alone;
};

/// Damping ratios of nothing at the start, too: they are brought into the bounds.
TEST(SampledMaterial, FitsLowerTheEnergyWithinPhysicalBounds) {
  for (const double ratio : {0.0, 0.2}) {
    const SampledScene scene(ratio);
    ASSERT_EQ(scene.forces_alone.status, SolveStatus::kConverged);
    for (const auto variables : {MaterialVariables::kMotionAndDynamics, MaterialVariables::kAll}) {
      MaterialOptions options;
      options.variables = variables;
      MaterialSolver solver(scene.chain, scene.timeline, scene.constraints, scene.material,
                            scene.motion, options);
      const MaterialReport report = solver.solve();
      EXPECT_TRUE(report.below_start);
      EXPECT_LT(report.total_energy, 0.9 * scene.forces_alone.total_energy);
      const ModeDynamics& fitted = solver.material().dynamics;
      EXPECT_EQ(fitted.discretisation, Discretisation::kSampled);
      EXPECT_EQ(fitted.smoothing, 4);
      EXPECT_NEAR(report.force_energy, force_energy(fitted, solver.motion()),
                  1e-8 * report.total_energy);
      for (Eigen::Index k = 0; k < fitted.stiffness.size(); ++k) {
        const ModeResponse response =
            mode_response(fitted.stiffness[k], fitted.damping[k], 1, Discretisation::kSampled);
        EXPECT_LE(response.frequency_hz, options.max_frequency * (1 + 1e-9)) << k;
        EXPECT_GE(response.damping_ratio, FitOptions::kLeastDampingRatio * (1 - 1e-9)) << k;
        EXPECT_LE(response.damping_ratio, FitOptions::kGreatestDampingRatio * (1 + 1e-9)) << k;
      }
    }
  }
}

TEST(SampledMaterial, ResponseIsThatOfTheOscillator) {
  const ModeResponse swing = mode_response(0.25, 2 * 0.3 * 0.5, 24, Discretisation::kSampled);
  EXPECT_NEAR(swing.frequency_hz, 0.5 / (2 * 3.14159265358979) * 24, 1e-12);
  EXPECT_NEAR(swing.damping_ratio, 0.3, 1e-12);
  EXPECT_NEAR(swing.decay_per_s, 0.15 * 24, 1e-12);
  const ModeResponse creep = mode_response(0.25, 2 * 1.25 * 0.5, 1, Discretisation::kSampled);
  EXPECT_NEAR(creep.damping_ratio, 1.25, 1e-12);
  EXPECT_NEAR(creep.decay_per_s, 0.5 * (1.25 - 0.75), 1e-12);
  EXPECT_EQ(mode_response(0, 0, 24, Discretisation::kSampled).frequency_hz, 0);
  for (const double frequency : {1e-6, 0.125, 0.5, 3.0})
    EXPECT_NEAR(
        frequency_of(stiffness_of(frequency, Discretisation::kSampled), Discretisation::kSampled),
        frequency, 1e-12 * frequency);
}

RecoveryOptions sampled_recovery(double smoothing) {
  RecoveryOptions options;
  options.modes = 3;
  options.discretisation = Discretisation::kSampled;
  options.smoothing = smoothing;
  return options;
}

ModeDynamics three_sampled_modes() {
  ModeDynamics dynamics = testing::three_modes();
  dynamics.discretisation = Discretisation::kSampled;
  return dynamics;
}

TEST(SampledRecovery, EnergyConforms) {
  for (const double smoothing : {0.0, 2.5}) {
    RecoveryOptions options = sampled_recovery(smoothing);
    options.driven_frames = 3;
    options.weight = 0.7;
    options.column_weight = 0.2;
    const RecoveryEnergy energy(testing::random_matrix(5, 14, 0.5, 2), options);
    RecoveredMotion at{testing::random_matrix(3, 14, 1, 3), testing::random_matrix(5, 3, 1, 4),
                       three_sampled_modes()};
    at.dynamics.smoothing = smoothing;
    const auto set = [&](const Eigen::VectorXd& x) -> const RecoveredMotion& {
      at.z = x.head(42).reshaped(3, 14);
      at.mixing = x.tail(15).reshaped(5, 3);
      return at;
    };
    limber::testing::EnergyUnderTest suite;
    suite.value = [&](const Eigen::VectorXd& x) { return energy.value(set(x)).total; };
    suite.gradient = [&](const Eigen::VectorXd& x) {
      Eigen::VectorXd result(57);
      result << energy.gradient_of_motion(set(x)).reshaped(),
          energy.gradient_of_mixing(at).reshaped();
      return result;
    };
    Eigen::VectorXd x(57);
    x << at.z.reshaped(), at.mixing.reshaped();
    limber::testing::expect_conforms(suite, x);
    // What a motion begins with is known here, and costs nothing.
    double begun = 0;
    for (Eigen::Index k = 0; k < 3; ++k) {
      const BeginningCost cost =
          beginning_cost(at.dynamics.stiffness[k], at.dynamics.damping[k], smoothing);
      begun += (std::pow(cost.place * at.z(k, 3), 2) +
                std::pow(cost.lag * at.z(k, 3) + cost.speed * at.z(k, 4), 2)) /
               2;
    }
    EXPECT_NEAR(energy.value(at).force + begun, force_energy(at.dynamics, at.z.rightCols(11)),
                1e-10 * energy.value(at).force);
    // The step to the minimum over z leaves no gradient.
    energy.fit_motion(at);
    EXPECT_LE(energy.gradient_of_motion(at).norm(), 1e-8 * energy.value(at).total);
  }
}

TEST(SampledRecovery, FindsTheModesOfAFreeMotionAndContinuesIt) {
  const ModeDynamics known = three_sampled_modes();
  const Eigen::MatrixXd whole = testing::unit_columns(6, 3, 1) * testing::free_motion(known, 150);
  for (const double smoothing : {0.0, 3.0}) {
    const Recovery found =
        recover(whole.leftCols(110), testing::eigenvalues(6), sampled_recovery(smoothing));
    EXPECT_EQ(found.swings.dynamics.discretisation, Discretisation::kSampled);
    for (Eigen::Index k = 0; k < 3; ++k) {
      Eigen::Index nearest = 0;
      EXPECT_LT(
          (found.swings.dynamics.stiffness.array() - known.stiffness[k]).abs().minCoeff(&nearest),
          1e-4);
      EXPECT_NEAR(found.swings.dynamics.damping[nearest], known.damping[k], 1e-4) << k;
    }
    const Continuation next = continue_freely(found, 40);
    EXPECT_EQ(next.bounded_modes, 0);
    EXPECT_LE((found.swings.mixing * next.z - whole.rightCols(40)).norm(),
              1e-2 * whole.rightCols(40).norm());
  }
}

/// lambda = 8 explodes by differences: sampled, it is only a fast swing.
TEST(SampledRecovery, NoContinuationExplodes) {
  RecoveredMotion motion{Eigen::MatrixXd::Ones(1, 2),
                         Eigen::MatrixXd::Ones(1, 1),
                         {Eigen::VectorXd::Constant(1, 8), Eigen::VectorXd::Constant(1, 0.5)}};
  EXPECT_EQ(continue_freely(motion, 50).bounded_modes, 1);
  motion.dynamics.discretisation = Discretisation::kSampled;
  const Continuation next = continue_freely(motion, 50);
  EXPECT_EQ(next.bounded_modes, 0);
  EXPECT_LE(next.z.cwiseAbs().maxCoeff(), 3);
  EXPECT_LE(next.z.rightCols(1).norm(), 1e-4);
}

TEST(SampledRecovery, RefusesAWarmStartWithOtherForces) {
  const Eigen::MatrixXd target = testing::random_matrix(4, 20, 1, 5);
  const RecoveredMotion warm{Eigen::MatrixXd::Zero(3, 20), Eigen::MatrixXd::Identity(4, 3),
                             testing::three_modes()};
  try {
    (void)recover(target, testing::eigenvalues(4), sampled_recovery(0), {}, &warm);
    FAIL() << "nothing was refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "warm");
  }
}

}  // namespace
}  // namespace limber::spacetime
