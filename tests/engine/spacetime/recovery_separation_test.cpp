// Frequencies that are nearly equal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/spacetime/recovery.h"
#include "engine/spacetime/recovery_start.h"
#include "engine/spacetime/recovery_swings.h"
#include "tests/engine/spacetime/recovery_problems.h"

namespace limber::spacetime {
namespace {

using testing::eigenvalues;
using testing::free_motion;
using ::testing::HasSubstr;
using testing::random_matrix;
using testing::unit_columns;

/// lambda of an undamped swing [1/frame^2].
double stiffness_of(double hertz) {
  constexpr double kTurn = 2 * 3.14159265358979323846, kFramesPerSecond = 30;
  return 2 - 2 * std::cos(kTurn * hertz / kFramesPerSecond);
}

/// Four swings of which two are nearly alike, in a body of many coordinates.
struct NearlyAlike {
  ModeDynamics dynamics{Eigen::Vector4d(stiffness_of(0.748), stiffness_of(0.843),
                                        stiffness_of(2.89), stiffness_of(3.58)),
                        Eigen::Vector4d::Zero()};
  Eigen::MatrixXd whole = unit_columns(12, 4, 11) * free_motion(dynamics, 300);
};

Eigen::VectorXd sorted_stiffness(const RecoveredMotion& motion) {
  Eigen::VectorXd stiffness = motion.dynamics.stiffness;
  std::sort(stiffness.begin(), stiffness.end());
  return stiffness;
}

TEST(RecoveryOfNearEqualFrequencies, TheDefaultStartSeparatesThem) {
  const NearlyAlike swings;
  const Eigen::MatrixXd noisy = swings.whole + random_matrix(12, 300, 1e-4, 3);
  RecoveryOptions options;
  options.modes = 4;
  const Recovery result = recover(noisy.leftCols(150), eigenvalues(12), options);
  EXPECT_EQ(result.report.status, RecoveryStatus::kConverged);
  EXPECT_EQ(result.report.message, "");
  const Eigen::VectorXd found = sorted_stiffness(result.motion);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(found[k], swings.dynamics.stiffness[k], 0.02 * swings.dynamics.stiffness[k]) << k;
  const Eigen::MatrixXd ahead = result.motion.mixing * continue_freely(result.motion, 150).z;
  EXPECT_LT((ahead - swings.whole.rightCols(150)).norm(), 0.1 * swings.whole.rightCols(150).norm());
}

TEST(RecoveryOfNearEqualFrequencies, PrincipalComponentsAloneMixThem) {
  const NearlyAlike swings;
  const Eigen::MatrixXd half = swings.whole.leftCols(150);
  const auto separated = separated_start(half, 4, 0);
  ASSERT_TRUE(separated);
  EXPECT_LT((separated->mixing * separated->z - half).norm(), 1e-9 * half.norm());
  // Each of its rows swings with a single frequency.
  const auto oscillator = fit_oscillator(separated->z, 0);
  ASSERT_TRUE(oscillator);
  Eigen::MatrixXd beside = oscillator->stiffness;
  beside.diagonal().setZero();
  EXPECT_LT(beside.cwiseAbs().maxCoeff(), 1e-6);
  const auto mixed = fit_oscillator(principal_start(half, 4).z, 0);
  beside = mixed->stiffness;
  beside.diagonal().setZero();
  EXPECT_GT(beside.cwiseAbs().maxCoeff(), 1e-3);
}

TEST(RecoveryOfNearEqualFrequencies, WhatCannotBeSeparatedIsSaid) {
  // Dynamics alone, with modes that are given and each of which swings with two frequencies.
  const NearlyAlike swings;
  Eigen::MatrixXd mixing = Eigen::MatrixXd::Identity(4, 4);
  mixing.topLeftCorner<2, 2>() << 1, -1, 1, 1;
  RecoveryOptions options;
  options.modes = 4;
  options.variables = MaterialVariables::kMotionAndDynamics;
  RecoveredMotion warm{mixing * free_motion(swings.dynamics, 150), Eigen::MatrixXd::Identity(4, 4),
                       swings.dynamics};
  const Recovery result = recover(warm.z, eigenvalues(4), options, {}, &warm);
  EXPECT_THAT(result.report.message, HasSubstr("the modes were not separated"));
  EXPECT_THAT(result.report.message, HasSubstr("modes 1 and 2 are coupled most"));
}

/// cos at each of these amplitudes and radians per frame, added up.
Eigen::RowVectorXd cosines(const std::vector<std::pair<double, double>>& parts, int frames) {
  Eigen::RowVectorXd z = Eigen::RowVectorXd::Zero(frames);
  for (const auto& [amplitude, angle] : parts)
    for (int i = 0; i < frames; ++i) z[i] += amplitude * std::cos(angle * i + 1);
  return z;
}

TEST(RecoveryOfSwings, AnotherFrequencyDoesNotBiasThem) {
  // Three quarters of a beat are recorded; forces alone give another stiffness.
  const double stiffness = stiffness_of(0.843), angle = std::acos(1 - stiffness / 2);
  const Eigen::RowVectorXd z = cosines({{1, angle}, {0.05, 0.82 * angle}}, 150);
  const ModeFit given = fit_mode(z);
  EXPECT_GT(std::abs(given.stiffness - stiffness), 2e-3 * stiffness);
  const ModeSwing swing = fit_swing(z, given);
  EXPECT_NEAR(swing.dynamics.stiffness, stiffness, 1e-6 * stiffness);
  EXPECT_NEAR(swing.dynamics.damping, 0, 1e-6);
  EXPECT_LT((swing.z - cosines({{1, angle}}, 150)).norm(), 1e-6 * z.norm());
}

TEST(RecoveryOfSwings, DampingIsThatOfTheSwing) {
  const ModeDynamics dynamics = testing::three_modes();
  const RecoveredMotion motion{free_motion(dynamics, 100),
                               Eigen::MatrixXd::Identity(3, 3),
                               {Eigen::Vector3d(0.05, 0.2, 1), Eigen::Vector3d::Zero()}};
  const RecoveredMotion found = swinging(motion, fit_swings(motion, 10));
  EXPECT_LT((found.dynamics.stiffness - dynamics.stiffness).norm(), 1e-8);
  EXPECT_LT((found.dynamics.damping - dynamics.damping).norm(), 1e-8);
  EXPECT_LT((found.z - motion.z).norm(), 1e-8 * motion.z.norm());
}

TEST(RecoveryOfSwings, SeveralFrequenciesOfOneModeAreSaid) {
  RecoveredMotion motion{
      cosines({{1, 0.15}, {0.8, 0.19}}, 150), Eigen::MatrixXd::Identity(2, 1), {}};
  const ModeFit given = fit_mode(motion.z.row(0));
  motion.dynamics = {Eigen::VectorXd::Constant(1, given.stiffness),
                     Eigen::VectorXd::Constant(1, given.damping)};
  const auto swings = fit_swings(motion, 0);
  EXPECT_GT(swings[0].residual, 0.2);
  EXPECT_LT(swings[0].several_residual, 1e-6);
  EXPECT_THAT(describe_several_frequencies(motion, swings, eigenvalues(2)),
              HasSubstr("the modes were not separated"));
  motion.z = cosines({{1, 0.15}}, 150);
  EXPECT_EQ(describe_several_frequencies(motion, fit_swings(motion, 0), eigenvalues(2)), "");
}

TEST(RecoveryOfSwings, TheContinuationBeginsWhereTheMotionEnds) {
  Recovery recovery;
  recovery.motion = {cosines({{1, 0.2}, {0.1, 0.17}}, 150),
                     Eigen::MatrixXd::Identity(1, 1),
                     {Eigen::VectorXd::Constant(1, 0.04), Eigen::VectorXd::Zero(1)}};
  recovery.swings = swinging(recovery.motion, fit_swings(recovery.motion, 0));
  const Eigen::MatrixXd ahead = continue_freely(recovery, 200).z;
  const double last = recovery.motion.z(0, 149), before = recovery.motion.z(0, 148);
  EXPECT_LT(std::abs(ahead(0, 0) - (2 * last - before)), 0.06);
  const Eigen::RowVectorXd alone = cosines({{1, 0.2}}, 350).tail(200);
  EXPECT_LT((ahead.row(0) - alone).tail(160).norm(), 1e-5 * alone.norm());
}

}  // namespace
}  // namespace limber::spacetime
