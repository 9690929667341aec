#include "engine/spacetime/recovery.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/spacetime/recovery_energy.h"
#include "engine/spacetime/recovery_start.h"
#include "engine/spacetime/recovery_step.h"
#include "tests/engine/spacetime/recovery_problems.h"
#include "tests/support/dense.h"
#include "tests/support/energy_conformance.h"

namespace limber::spacetime {
namespace {

using testing::eigenvalues;
using testing::free_motion;
using testing::random_matrix;
using testing::three_modes;
using testing::unit_columns;

/// Free motions of three modes, mixed into R coordinates, and noise.
Eigen::MatrixXd noisy_target(int coordinates, int frames, double noise) {
  return unit_columns(coordinates, 3, 1) * free_motion(three_modes(), frames) +
         random_matrix(coordinates, frames, noise, 2);
}

void expect_dynamics(const ModeDynamics& got, const ModeDynamics& wanted, double tolerance) {
  for (Eigen::Index k = 0; k < wanted.stiffness.size(); ++k) {
    Eigen::Index nearest = 0;
    EXPECT_LT((got.stiffness.array() - wanted.stiffness[k]).abs().minCoeff(&nearest), tolerance);
    EXPECT_NEAR(got.damping[nearest], wanted.damping[k], tolerance) << k;
  }
}

TEST(Recovery, EnergyConforms) {
  RecoveryOptions options;
  options.driven_frames = 3;
  options.weight = 0.7;
  options.column_weight = 0.2;
  const RecoveryEnergy energy(noisy_target(5, 14, 0.1), options);
  RecoveredMotion at{random_matrix(3, 14, 1, 3), random_matrix(5, 3, 1, 4), three_modes()};
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
}

TEST(Recovery, TheMotionOfGivenMaterialIsThatOfADenseSolve) {
  RecoveryOptions options;
  const Eigen::MatrixXd target = noisy_target(5, 12, 0.3);
  const RecoveryEnergy energy(target, options);
  RecoveredMotion at{random_matrix(3, 12, 1, 3), random_matrix(5, 3, 1, 4), three_modes()};
  // The energy is quadratic in z: its Hessian from differences of gradients is exact.
  const Eigen::VectorXd gradient = energy.gradient_of_motion(at).reshaped();
  Eigen::MatrixXd hessian(36, 36);
  for (int i = 0; i < 36; ++i) {
    RecoveredMotion moved = at;
    moved.z.data()[i] += 1;
    hessian.col(i) = Eigen::VectorXd(energy.gradient_of_motion(moved).reshaped()) - gradient;
  }
  const Eigen::VectorXd expected =
      Eigen::VectorXd(at.z.reshaped()) - reference::solve_symmetric(hessian, gradient);
  energy.fit_motion(at);
  EXPECT_LT((Eigen::VectorXd(at.z.reshaped()) - expected).norm(), 1e-9 * expected.norm());
}

TEST(Recovery, KnownDynamicsAndModesComeBack) {
  const Eigen::MatrixXd target = noisy_target(8, 60, 0);
  RecoveryOptions options;
  options.modes = 3;
  options.tolerance = 1e-12;
  const Recovery result = recover(target, eigenvalues(8), options);
  EXPECT_EQ(result.report.status, RecoveryStatus::kConverged) << result.report.message;
  expect_dynamics(result.motion.dynamics, three_modes(), 1e-5);
  EXPECT_LT((result.motion.mixing * result.motion.z - target).norm(), 1e-4 * target.norm());
  // Columns come back up to order and sign.
  const Eigen::MatrixXd overlap = unit_columns(8, 3, 1).transpose() * result.motion.mixing;
  EXPECT_GT(overlap.cwiseAbs().rowwise().maxCoeff().minCoeff(), 0.999);
}

TEST(Recovery, DynamicsAloneComeBackWhereModesAreKnown) {
  const Eigen::MatrixXd target = free_motion(three_modes(), 80);
  RecoveryOptions options;
  options.modes = 3;
  options.tolerance = 1e-12;
  options.variables = MaterialVariables::kMotionAndDynamics;
  const Recovery result = recover(target, eigenvalues(3), options);
  EXPECT_LT((result.motion.dynamics.stiffness - three_modes().stiffness).norm(), 1e-6);
  EXPECT_LT((result.motion.dynamics.damping - three_modes().damping).norm(), 1e-6);
  // z alone has to force what free dynamics would do.
  options.variables = MaterialVariables::kMotion;
  const Recovery motion = recover(target, eigenvalues(3), options);
  EXPECT_GT(motion.report.energies.force, 1e3 * result.report.energies.force);
}

TEST(Recovery, NeitherMotionNorModesNorScaleCanBeBetter) {
  const Eigen::MatrixXd target = noisy_target(6, 40, 0.02);
  RecoveryOptions options;
  options.modes = 3;
  options.tolerance = 1e-13;
  const Recovery result = recover(target, eigenvalues(6), options);
  const RecoveryEnergy energy(target, options);
  EXPECT_LT(energy.gradient_of_motion(result.motion).norm(), 1e-5);
  EXPECT_LT(energy.gradient_of_mixing(result.motion).norm(), 1e-5);
  for (const double factor : {0.98, 1.02}) {
    RecoveredMotion other = result.motion;
    other.mixing.col(1) *= factor;
    other.z.row(1) /= factor;
    EXPECT_GT(energy.value(other).total, result.report.energies.total) << factor;
  }
}

// Block after block, as in the paper (section 5.1), each of them exactly.
TEST(Recovery, EndsNoHigherThanTheAlternation) {
  const Eigen::MatrixXd target = noisy_target(6, 40, 0.05);
  RecoveryOptions options;
  options.modes = 2;
  const RecoveryEnergy energy(target, options);
  RecoveredMotion at = principal_start(target, 2);
  for (int round = 0; round < 300; ++round) {
    energy.fit_dynamics(at);
    at.mixing =
        reference::solve_symmetric(at.z * at.z.transpose(), at.z * target.transpose()).transpose();
    energy.balance(at);
    energy.fit_motion(at);
  }
  const Recovery result = recover(target, eigenvalues(6), options);
  EXPECT_EQ(result.report.status, RecoveryStatus::kConverged);
  EXPECT_LT(result.report.energies.total, energy.value(at).total * (1 + 1e-5));
}

TEST(Recovery, NoStepRaisesTheEnergy) {
  const Eigen::MatrixXd target = noisy_target(7, 50, 0.2);
  RecoveryOptions options;
  const RecoveryEnergy energy(target, options);
  RecoveredMotion at = spectrum_start(target, eigenvalues(7), 4);
  RecoveryStep step(energy);
  double before = energy.value(at).total;
  for (int i = 0; i < 30; ++i) {
    const double gained = step.take(at);
    const double now = energy.value(at).total;
    EXPECT_GE(gained, 0);
    EXPECT_NEAR(before - gained, now, 1e-12 * before);
    before = now;
  }
}

TEST(Recovery, MoreVariablesMeanLessEnergy) {
  const Eigen::MatrixXd target = noisy_target(8, 60, 0.01);
  RecoveryOptions options;
  options.modes = 2;
  double before = std::numeric_limits<double>::infinity();
  for (const auto variables : {MaterialVariables::kMotion, MaterialVariables::kMotionAndDynamics,
                               MaterialVariables::kAll}) {
    options.variables = variables;
    options.start = RecoveryStart::kSpectrum;
    const RecoveryEnergies found = recover(target, eigenvalues(8), options).report.energies;
    EXPECT_LT(found.total, before);
    before = found.total;
  }
}

TEST(Recovery, ForcesOfDrivenFramesDoNotCount) {
  // Pushed for ten frames, then free.
  const double lambda = 0.05, d = 0.01;
  Eigen::MatrixXd target(1, 80);
  target(0, 0) = target(0, 1) = 0;
  for (int i = 1; i + 1 < 80; ++i) {
    const double push = i <= 10 ? 0.1 : 0;
    target(0, i + 1) = (push + (2 + d - lambda) * target(0, i) - target(0, i - 1)) / (1 + d);
  }
  RecoveryOptions options;
  options.modes = 1;
  const Eigen::VectorXd one = eigenvalues(1);
  EXPECT_GT(std::abs(recover(target, one, options).motion.dynamics.damping[0] - d), 0.3 * d);
  options.driven_frames = 10;
  const Recovery result = recover(target, one, options);
  EXPECT_NEAR(result.motion.dynamics.stiffness[0], lambda, 1e-6);
  EXPECT_NEAR(result.motion.dynamics.damping[0], d, 1e-6);
}

TEST(Recovery, TheSpectrumScalesTheEigenvalues) {
  // The second mode swings most, 5 times in 100 frames, about a pose far from rest.
  Eigen::MatrixXd target(4, 100);
  for (int i = 0; i < 100; ++i) {
    target(0, i) = 0.1 * std::sin(0.02 * i);
    target(1, i) = 30 + std::cos(0.1 * EIGEN_PI * i);
    target(2, i) = 0;
    target(3, i) = 100 * std::sin(i);  // of no mode that is asked for
  }
  const RecoveredMotion start = spectrum_start(target, eigenvalues(4), 3);
  const double wanted = std::pow(0.1 * EIGEN_PI, 2);
  EXPECT_NEAR(start.dynamics.stiffness[1], wanted, 1e-12);
  EXPECT_NEAR(start.dynamics.stiffness[0], wanted / 4, 1e-12);
  EXPECT_NEAR(start.dynamics.stiffness[2], wanted * 9 / 4, 1e-12);
  EXPECT_TRUE(start.dynamics.damping.isZero(0));
  EXPECT_TRUE(start.mixing.isIdentity(0));
}

TEST(Recovery, AMotionContinuesFreely) {
  const Eigen::MatrixXd all = free_motion(three_modes(), 50);
  const RecoveredMotion half{all.leftCols(20), Eigen::MatrixXd::Identity(3, 3), three_modes()};
  const Continuation result = continue_freely(half, 30);
  EXPECT_LT((result.z - all.rightCols(30)).norm(), 1e-12 * all.norm());
  EXPECT_EQ(result.bounded_modes, 0);
  // Stiffness that the recurrence cannot take.
  RecoveredMotion stiff = half;
  stiff.dynamics.stiffness[2] = 20;
  for (const double damping : {0.0, 0.1, 3.0}) {
    stiff.dynamics.damping[2] = damping;
    const Continuation bounded = continue_freely(stiff, 1000);
    EXPECT_EQ(bounded.bounded_modes, 1);
    EXPECT_LT(bounded.z.cwiseAbs().maxCoeff(), 5 * half.z.cwiseAbs().maxCoeff()) << damping;
  }
}

}  // namespace
}  // namespace limber::spacetime
