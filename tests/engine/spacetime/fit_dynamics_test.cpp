#include "engine/spacetime/fit_dynamics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/random.h"

namespace limber::spacetime {
namespace {

double cost(const Eigen::RowVectorXd& z, double stiffness, double damping) {
  double sum = 0;
  for (Eigen::Index i = 1; i + 1 < z.size(); ++i) {
    const double residual =
        z[i + 1] - 2 * z[i] + z[i - 1] + damping * (z[i + 1] - z[i]) + stiffness * z[i];
    sum += residual * residual;
  }
  return sum;
}

/// Least of a convex function on [0, size], by thirds.
template <typename Function>
double minimum(Function&& function, double size) {
  double low = 0, high = size;
  for (int round = 0; round < 80; ++round) {
    const double left = low + (high - low) / 3, right = high - (high - low) / 3;
    (function(left) < function(right) ? high : low) =
        function(left) < function(right) ? right : left;
  }
  return function(0.5 * (low + high));
}

double brute_force(const Eigen::RowVectorXd& z, double size) {
  return minimum(
      [&](double damping) {
        return minimum([&](double stiffness) { return cost(z, stiffness, damping); }, size);
      },
      size);
}

Eigen::RowVectorXd free_motion(double stiffness, double damping, int frames) {
  Eigen::RowVectorXd z(frames);
  z[0] = 1;
  z[1] = 0.9;
  for (int i = 1; i + 1 < frames; ++i)
    z[i + 1] = ((2 + damping - stiffness) * z[i] - z[i - 1]) / (1 + damping);
  return z;
}

TEST(FitDynamics, GivesBackTheDynamicsOfAFreeMotion) {
  for (const double stiffness : {1e-4, 0.02, 0.7, 3.5}) {
    for (const double damping : {0.0, 1e-3, 0.2, 1.5}) {
      const ModeFit fit = fit_mode(free_motion(stiffness, damping, 60));
      EXPECT_NEAR(fit.stiffness, stiffness, 1e-9) << stiffness << " " << damping;
      EXPECT_NEAR(fit.damping, damping, 1e-9) << stiffness << " " << damping;
    }
  }
}

TEST(FitDynamics, NoOtherDynamicsNeedLessForce) {
  Random random(5);
  int stiffness_bound = 0, damping_bound = 0, inside = 0;
  for (int trial = 1; trial <= 24; ++trial) {
    // From mostly free motion to mostly noise, with a drift or without.
    Eigen::RowVectorXd z = (trial % 4 == 2 ? 0.02 : 1) * free_motion(0.1, 0.1, 12);
    for (int i = 0; i < z.size(); ++i)
      z[i] += 0.004 * trial * random.normal() + (trial % 4 == 3 ? 0.5 * i : 0);
    const ModeFit fit = fit_mode(z);
    EXPECT_GE(fit.stiffness, 0);
    EXPECT_GE(fit.damping, 0);
    const double best = brute_force(z, 100);
    const double found = cost(z, fit.stiffness, fit.damping);
    EXPECT_LE(found, best * (1 + 1e-10)) << trial;
    EXPECT_GE(found, best * (1 - 1e-6)) << trial;
    stiffness_bound += fit.stiffness == 0;
    damping_bound += fit.damping == 0;
    inside += fit.stiffness > 0 && fit.damping > 0;
  }
  EXPECT_GT(damping_bound, 0);
  EXPECT_GT(inside, 0);
  EXPECT_GT(stiffness_bound, 0);
}

TEST(FitDynamics, NoOtherDynamicsWithinABoundNeedLessForce) {
  Random random(11);
  const double bound = 0.3;
  int at_bound = 0, at_bound_damped = 0, inside = 0;
  for (int trial = 1; trial <= 24; ++trial) {
    Eigen::RowVectorXd z = free_motion(trial % 3 == 0 ? 0.1 : 0.8, trial % 2 == 0 ? 0.1 : 0.6, 12);
    for (int i = 0; i < z.size(); ++i) z[i] += 0.002 * trial * random.normal();
    const ModeFit fit = fit_mode(z, bound);
    EXPECT_GE(fit.stiffness, 0);
    EXPECT_LE(fit.stiffness, bound);
    EXPECT_GE(fit.damping, 0);
    const double best = minimum(
        [&](double damping) {
          return minimum([&](double stiffness) { return cost(z, stiffness, damping); }, bound);
        },
        100);
    const double found = cost(z, fit.stiffness, fit.damping);
    EXPECT_LE(found, best * (1 + 1e-10)) << trial;
    EXPECT_GE(found, best * (1 - 1e-6)) << trial;
    at_bound += fit.stiffness == bound;
    at_bound_damped += fit.stiffness == bound && fit.damping > 0;
    inside += fit.stiffness > 0 && fit.stiffness < bound;
  }
  EXPECT_GT(at_bound, 0);
  EXPECT_GT(at_bound_damped, 0);
  EXPECT_GT(inside, 0);
}

TEST(FitDynamics, ALambdaDrivenToItsBound) {
  // Growing, z'' > 0 with z > 0: stiffness would be negative.
  Eigen::RowVectorXd z(20);
  for (int i = 0; i < 20; ++i) z[i] = std::cosh(0.2 * i);
  const ModeFit fit = fit_mode(z);
  EXPECT_EQ(fit.stiffness, 0);
  EXPECT_EQ(fit.damping, 0);
  // Slowing down towards where it goes: damping alone.
  for (int i = 0; i < 20; ++i) z[i] = 3 - std::pow(1 / 1.25, i);
  const ModeFit slowing = fit_mode(z);
  EXPECT_NEAR(slowing.damping, 0.25, 1e-12);
  EXPECT_NEAR(slowing.stiffness, 0, 1e-12);
}

TEST(FitDynamics, AMotionThatIsZeroOrConstantOrShort) {
  for (const Eigen::RowVectorXd& z :
       {Eigen::RowVectorXd(Eigen::RowVectorXd::Zero(30)),
        Eigen::RowVectorXd(Eigen::RowVectorXd::Constant(30, 0.3)),
        Eigen::RowVectorXd(Eigen::RowVectorXd::LinSpaced(2, 0, 1)), Eigen::RowVectorXd()}) {
    const ModeFit fit = fit_mode(z);
    EXPECT_EQ(fit.stiffness, 0);
    EXPECT_EQ(fit.damping, 0);
  }
}

TEST(FitDynamics, AGeometricMotionIsDampedOnly) {
  for (const double ratio : {0.3, 0.9, 0.999}) {
    Eigen::RowVectorXd z(40);
    for (int i = 0; i < 40; ++i) z[i] = std::pow(ratio, i);
    const ModeFit fit = fit_mode(z);
    EXPECT_EQ(fit.stiffness, 0) << ratio;
    EXPECT_NEAR(fit.damping, (1 - ratio) / ratio, 1e-10) << ratio;
  }
  // Changing sign each frame: either could do it, so no damping.
  Eigen::RowVectorXd z(10);
  for (int i = 0; i < 10; ++i) z[i] = i % 2 == 0 ? 1 : -1;
  EXPECT_EQ(fit_mode(z).damping, 0);
  EXPECT_NEAR(fit_mode(z).stiffness, 4, 1e-12);
}

TEST(FitDynamics, DoesNotDependOnScale) {
  const Eigen::RowVectorXd z = free_motion(0.05, 0.01, 40);
  for (const double scale : {1e-250, 1e-6, 1e250}) {
    EXPECT_NEAR(fit_mode(scale * z).stiffness, 0.05, 1e-12);
    EXPECT_NEAR(fit_mode(scale * z).damping, 0.01, 1e-12);
  }
}

TEST(FitDynamics, RefusesWhatIsNotFinite) {
  Eigen::RowVectorXd z = Eigen::RowVectorXd::Zero(9);
  z[4] = std::numeric_limits<double>::quiet_NaN();
  try {
    (void)fit_mode(z);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(error.field(), "z");
  }
}

}  // namespace
}  // namespace limber::spacetime
