#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/spacetime/recovery.h"
#include "engine/spacetime/recovery_energy.h"
#include "engine/spacetime/recovery_start.h"
#include "engine/spacetime/recovery_step.h"
#include "tests/engine/spacetime/recovery_problems.h"

namespace limber::spacetime {
namespace {

using testing::eigenvalues;
using testing::free_motion;
using testing::random_matrix;
using testing::three_modes;
using testing::unit_columns;

void expect_finite(const RecoveredMotion& motion) {
  EXPECT_TRUE(motion.z.allFinite());
  EXPECT_TRUE(motion.mixing.allFinite());
  EXPECT_TRUE(motion.dynamics.stiffness.allFinite());
  EXPECT_TRUE(motion.dynamics.damping.allFinite());
  EXPECT_GE(motion.dynamics.stiffness.minCoeff(), 0);
  EXPECT_GE(motion.dynamics.damping.minCoeff(), 0);
}

Eigen::MatrixXd mixed_motion(int coordinates, int frames) {
  return unit_columns(coordinates, 3, 1) * free_motion(three_modes(), frames);
}

TEST(RecoveryHardCases, ROfOne) {
  const ModeDynamics one{Eigen::VectorXd::Constant(1, 0.06), Eigen::VectorXd::Constant(1, 0.01)};
  const Eigen::MatrixXd target = unit_columns(9, 1, 4) * free_motion(one, 50);
  RecoveryOptions options;
  options.modes = 1;
  for (const auto start : {RecoveryStart::kPrincipalComponents, RecoveryStart::kSpectrum}) {
    options.start = start;
    const Recovery result = recover(target, eigenvalues(9), options);
    EXPECT_EQ(result.report.status, RecoveryStatus::kConverged);
    EXPECT_NEAR(result.motion.dynamics.stiffness[0], 0.06, 1e-5);
    EXPECT_NEAR(result.motion.dynamics.damping[0], 0.01, 1e-5);
  }
}

TEST(RecoveryHardCases, REqualsR) {
  const Eigen::MatrixXd target = mixed_motion(3, 40) + random_matrix(3, 40, 1e-3, 5);
  RecoveryOptions options;
  options.modes = 3;
  for (const auto start : {RecoveryStart::kPrincipalComponents, RecoveryStart::kSpectrum}) {
    options.start = start;
    const Recovery result = recover(target, eigenvalues(3), options);
    expect_finite(result.motion);
    EXPECT_LT(result.report.energies.total, 1e-4);
    EXPECT_LE(result.report.energies.total, result.report.start.total);
  }
}

TEST(RecoveryHardCases, AMotionThatIsZero) {
  RecoveryOptions options;
  options.modes = 2;
  for (const auto variables : {MaterialVariables::kMotion, MaterialVariables::kMotionAndDynamics,
                               MaterialVariables::kAll}) {
    options.variables = variables;
    const Recovery result = recover(Eigen::MatrixXd::Zero(5, 20), eigenvalues(5), options);
    EXPECT_TRUE(result.motion.z.isZero(0));
    EXPECT_TRUE(result.motion.mixing.isIdentity(0));
    EXPECT_TRUE(result.motion.dynamics.stiffness.isZero(0));
    EXPECT_EQ(result.report.energies.total, 0);
    EXPECT_EQ(result.report.status, RecoveryStatus::kConverged);
    EXPECT_FALSE(result.report.message.empty());
    EXPECT_TRUE(continue_freely(result.motion, 10).z.isZero(0));
  }
}

TEST(RecoveryHardCases, APoseThatDoesNotMove) {
  const Eigen::MatrixXd target = unit_columns(5, 1, 2).replicate(1, 30);
  RecoveryOptions options;
  options.modes = 2;
  for (const auto start : {RecoveryStart::kPrincipalComponents, RecoveryStart::kSpectrum}) {
    options.start = start;
    const Recovery result = recover(target, eigenvalues(5), options);
    expect_finite(result.motion);
    EXPECT_LT(result.report.energies.total, 1e-6);
  }
}

TEST(RecoveryHardCases, ALambdaDrivenToItsBound) {
  // One mode swings, the other falls away from rest.
  Eigen::MatrixXd z(2, 40);
  for (int i = 0; i < 40; ++i) {
    z(0, i) = std::cos(0.3 * i);
    z(1, i) = 0.2 * std::cosh(0.1 * i);
  }
  const Eigen::MatrixXd target = unit_columns(6, 2, 3) * z;
  RecoveryOptions options;
  options.modes = 2;
  const Recovery result = recover(target, eigenvalues(6), options);
  expect_finite(result.motion);
  EXPECT_EQ(result.motion.dynamics.stiffness.minCoeff(), 0);
  EXPECT_NEAR(result.motion.dynamics.stiffness.maxCoeff(), 2 - 2 * std::cos(0.3), 0.02);
}

TEST(RecoveryHardCases, SWithAColumnGoingToZero) {
  const Eigen::MatrixXd target = mixed_motion(6, 40);
  RecoveryOptions options;
  options.modes = 3;
  const Recovery whole = recover(target, eigenvalues(6), options);
  // A column of zeros is a stationary point of the energy, and no minimum.
  for (const double length : {0.0, 1e-9}) {
    RecoveredMotion lost = whole.motion;
    lost.mixing.col(1) *= length;
    const Recovery result = recover(target, eigenvalues(6), options, {}, &lost);
    expect_finite(result.motion);
    EXPECT_GE(result.motion.mixing.colwise().norm().minCoeff(), 1 - 1e-9);
    EXPECT_LT(result.report.energies.total, 1e-4 * result.report.start.total);
  }
}

TEST(RecoveryHardCases, MoreModesThanTheMotionHas) {
  const ModeDynamics one{Eigen::VectorXd::Constant(1, 0.06), Eigen::VectorXd::Constant(1, 0.01)};
  const Eigen::MatrixXd target = unit_columns(6, 1, 4) * free_motion(one, 40);
  RecoveryOptions options;
  options.modes = 4;
  for (const auto start : {RecoveryStart::kPrincipalComponents, RecoveryStart::kSpectrum}) {
    options.start = start;
    const Recovery result = recover(target, eigenvalues(6), options);
    expect_finite(result.motion);
    EXPECT_LT(result.report.energies.total, 1e-6);
  }
}

TEST(RecoveryHardCases, RestartingFromAConvergedResultChangesNothing) {
  const Eigen::MatrixXd target = mixed_motion(6, 40) + random_matrix(6, 40, 0.02, 8);
  for (const auto variables : {MaterialVariables::kMotion, MaterialVariables::kMotionAndDynamics,
                               MaterialVariables::kAll}) {
    RecoveryOptions options;
    options.modes = 2;
    options.variables = variables;
    options.tolerance = 1e-10;
    const Recovery first = recover(target, eigenvalues(6), options);
    ASSERT_EQ(first.report.status, RecoveryStatus::kConverged);
    const Recovery again = recover(target, eigenvalues(6), options, {}, &first.motion);
    EXPECT_LE(again.report.steps, 5);
    const double energy = first.report.energies.total;
    EXPECT_NEAR(again.report.energies.total, energy, 1e-8 * energy);
    EXPECT_LT((again.motion.z - first.motion.z).norm(), 1e-3 * first.motion.z.norm());
    EXPECT_LT((again.motion.dynamics.stiffness - first.motion.dynamics.stiffness).norm(), 1e-3);
  }
}

TEST(RecoveryHardCases, MoreModesThanAreCoupledLowerTheEnergyInTurns) {
  const Eigen::MatrixXd target = mixed_motion(50, 60) + random_matrix(50, 60, 0.05, 3);
  RecoveryOptions options;
  options.modes = 40;
  options.max_steps = 30;
  const Recovery result = recover(target, eigenvalues(50), options);
  EXPECT_TRUE(result.motion.z.allFinite() && result.motion.mixing.allFinite());
  EXPECT_LT(result.report.energies.total, 0.7 * result.report.start.total);
}

TEST(RecoveryHardCases, TinyAndHugeMotions) {
  for (const double scale : {1e-9, 1e6}) {
    const Eigen::MatrixXd target = scale * mixed_motion(6, 40);
    RecoveryOptions options;
    options.modes = 3;
    const Recovery result = recover(target, eigenvalues(6), options);
    expect_finite(result.motion);
    EXPECT_LT((result.motion.mixing * result.motion.z - target).norm(), 1e-2 * target.norm());
  }
}

void expect_refused(const std::string& field, const std::function<void()>& call) {
  try {
    call();
    FAIL() << field;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument) << error.what();
    EXPECT_EQ(error.field(), field) << error.what();
  }
}

TEST(RecoveryBadInput, NamesItsField) {
  const Eigen::MatrixXd good = mixed_motion(5, 20);
  const Eigen::VectorXd values = eigenvalues(5);
  RecoveryOptions options;
  options.modes = 2;
  const auto attempt = [&](const Eigen::MatrixXd& target) {
    (void)recover(target, values, options);
  };
  expect_refused("target", [&] { attempt(good.leftCols(7)); });
  Eigen::MatrixXd nan = good;
  nan(2, 3) = std::numeric_limits<double>::quiet_NaN();
  expect_refused("target", [&] { attempt(nan); });
  options.driven_frames = 13;
  expect_refused("target", [&] { attempt(good); });
  options.driven_frames = 0;
  options.modes = 6;
  expect_refused("modes", [&] { attempt(good); });
  options.modes = 2;
  expect_refused("eigenvalues", [&] { (void)recover(good, eigenvalues(4), options); });
  expect_refused("eigenvalues", [&] { (void)recover(good, -values, options); });
  RecoveredMotion warm = recover(good, values, options).motion;
  warm.dynamics.damping[0] = -1;
  expect_refused("warm", [&] { (void)recover(good, values, options, {}, &warm); });
  warm = {};
  expect_refused("warm", [&] { (void)recover(good, values, options, {}, &warm); });
  expect_refused("motion", [&] { (void)continue_freely(warm, 3); });
  expect_refused("frames",
                 [&] { (void)continue_freely(recover(good, values, options).motion, -1); });
  const auto invalid = [&](const char* field, const std::function<void(RecoveryOptions&)>& spoil) {
    RecoveryOptions bad;
    spoil(bad);
    expect_refused(field, [&] { bad.validate(); });
  };
  invalid("modes", [](RecoveryOptions& o) { o.modes = 0; });
  invalid("weight", [](RecoveryOptions& o) { o.weight = 0; });
  invalid("weight", [](RecoveryOptions& o) { o.weight = 1e-30; });
  invalid("column_weight", [](RecoveryOptions& o) { o.column_weight = -1; });
  invalid("driven_frames", [](RecoveryOptions& o) { o.driven_frames = -1; });
  invalid("tolerance", [](RecoveryOptions& o) { o.tolerance = 1; });
  invalid("max_steps", [](RecoveryOptions& o) { o.max_steps = 0; });
}

TEST(RecoveryBadInput, StopsWithinAStep) {
  for (const int modes : {20, 40}) {
    const Eigen::MatrixXd target = mixed_motion(50, 60) + random_matrix(50, 60, 0.05, 3);
    RecoveryOptions options;
    options.modes = modes;
    const RecoveryEnergy energy(target, options);
    RecoveredMotion at = principal_start(target, modes);
    energy.fit_dynamics(at);
    JobContext job;
    job.cancellation.request();
    RecoveryStep step(energy);
    EXPECT_THROW((void)step.take(at, job), Error);
  }
}

TEST(RecoveryBadInput, StopsOnRequest) {
  const JobContext job;
  job.cancellation.request();
  RecoveryOptions options;
  options.modes = 2;
  try {
    (void)recover(mixed_motion(5, 20), eigenvalues(5), options, job);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

}  // namespace
}  // namespace limber::spacetime
