#include "engine/spacetime/fit_dynamics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/material.h"

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

/// E_f of one mode by another way than the fit's.
double form_cost(const Eigen::RowVectorXd& z, const FitOptions& options, const ModeFit& fit) {
  const ModeDynamics dynamics{Eigen::VectorXd::Constant(1, fit.stiffness),
                              Eigen::VectorXd::Constant(1, fit.damping), options.discretisation,
                              options.smoothing};
  return force_energy(dynamics, z);
}

FitOptions sampled_options(double smoothing) { return {Discretisation::kSampled, smoothing}; }

Eigen::RowVectorXd free_sampled_motion(double omega, double zeta, int frames) {
  const ForceStencil stencil =
      force_stencil(Discretisation::kSampled, omega * omega, 2 * zeta * omega);
  Eigen::RowVectorXd z(frames);
  z[0] = 1;
  z[1] = 0.9;
  for (int i = 1; i + 1 < frames; ++i)
    z[i + 1] = -(stencil.centre * z[i] + stencil.before * z[i - 1]) / stencil.next;
  return z;
}

Eigen::RowVectorXd noise(int frames, std::uint64_t seed) {
  Random random(seed);
  Eigen::RowVectorXd z(frames);
  for (double& value : z) value = random.uniform(-1, 1);
  return z;
}

TEST(FitSampled, GivesBackTheDynamicsOfAFreeMotion) {
  for (const double omega : {0.02, 0.157, 0.9, 2.0, 3.0}) {
    for (const double zeta : {1e-4, 0.01, 0.2, 0.7, 0.98, 1.3, 1.9}) {
      for (const double smoothing : {0.0, 5.0}) {
        FitOptions options = sampled_options(smoothing);
        options.beginning = Beginning::kAnyhow;
        const ModeFit fit = fit_mode(free_sampled_motion(omega, zeta, 60), options);
        EXPECT_NEAR(std::sqrt(fit.stiffness), omega, 1e-6 * omega) << omega << " " << zeta;
        EXPECT_NEAR(fit.damping / (2 * omega), zeta, 1e-5) << omega << " " << zeta;
      }
    }
  }
}

/// Against a fine grid over all that is allowed.
TEST(FitSampled, IsTheLeastForceWithinItsBounds) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    Eigen::RowVectorXd z = noise(50, seed);
    if (seed % 2 == 0)
      for (int i = 2; i < 50; ++i) z[i] = 0.05 * z[i] + 1.9 * z[i - 1] - 0.95 * z[i - 2];
    for (const double smoothing : {0.0, 3.0}) {
      for (const double max_omega : {0.3, 0.785, 3.14159}) {
        FitOptions options = sampled_options(smoothing);
        options.max_stiffness = max_omega * max_omega;
        const ModeFit fit = fit_mode(z, options);
        const double ratio = fit.damping / (2 * std::sqrt(fit.stiffness));
        EXPECT_LE(fit.stiffness, options.max_stiffness * (1 + 1e-12));
        EXPECT_GE(ratio, FitOptions::kLeastDampingRatio * (1 - 1e-9));
        EXPECT_LE(ratio, FitOptions::kGreatestDampingRatio * (1 + 1e-9));
        double least = form_cost(z, options, {0, 0});
        for (int i = 1; i <= 60; ++i) {
          for (int j = 0; j <= 40; ++j) {
            const double omega = max_omega * i / 60, zeta = 1e-4 * std::pow(2e4, j / 40.0);
            least = std::min(least, form_cost(z, options, {omega * omega, 2 * zeta * omega}));
          }
        }
        EXPECT_LE(form_cost(z, options, fit), least * (1 + 1e-9)) << seed << " " << max_omega;
      }
    }
  }
}

TEST(FitSampled, IsNoWorseThanWhatIsKnown) {
  for (const std::uint64_t seed : {5U, 6U, 7U}) {
    const Eigen::RowVectorXd z = noise(20, seed);
    for (const double omega : {0.1, 1.0, 3.0}) {
      for (const double zeta : {1e-3, 0.5, 2.0}) {
        FitOptions options = sampled_options(2);
        options.known = {omega * omega, 2 * zeta * omega};
        EXPECT_LE(form_cost(z, options, fit_mode(z, options)),
                  form_cost(z, options, *options.known) * (1 + 1e-12));
      }
    }
  }
}

TEST(FitSampled, IsNothingForWhatDoesNotMoveByItself) {
  for (const double smoothing : {0.0, 4.0}) {
    const FitOptions options = sampled_options(smoothing);
    for (const Eigen::RowVectorXd& z :
         {Eigen::RowVectorXd::Zero(20).eval(), Eigen::RowVectorXd::Constant(20, 3).eval(),
          Eigen::RowVectorXd::LinSpaced(2, 0, 1).eval()}) {
      const ModeFit fit = fit_mode(z, options);
      EXPECT_NEAR(fit.stiffness, 0, 1e-12);
      EXPECT_NEAR(fit.damping, 0, 1e-12);
    }
  }
}

TEST(FitSampled, DoesNotDependOnTheScale) {
  const Eigen::RowVectorXd z = noise(40, 8);
  const ModeFit fit = fit_mode(z, sampled_options(3));
  for (const double scale : {1e-150, 1e-3, 1e150}) {
    const ModeFit scaled = fit_mode(scale * z, sampled_options(3));
    EXPECT_NEAR(scaled.stiffness, fit.stiffness, 1e-7);
    EXPECT_NEAR(scaled.damping, fit.damping, 1e-7);
  }
}

TEST(FitDynamics, WithSmoothForcesIsTheirLeastOnes) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Eigen::RowVectorXd z = noise(30, seed);
    FitOptions options;
    options.smoothing = 4;
    const ModeFit fit = fit_mode(z, options);
    const double least = minimum(
        [&](double damping) {
          return minimum(
              [&](double stiffness) {
                return form_cost(z, options, {stiffness, damping});
              },
              8);
        },
        8);
    EXPECT_NEAR(form_cost(z, options, fit), least, 1e-9 * least);
  }
}

TEST(BoundedFit, LowersFrequenciesAndKeepsDampingRatios) {
  FitOptions options = sampled_options(0);
  options.max_stiffness = 0.25;
  const ModeFit lowered = bounded_fit({4, 2 * 0.3 * 2}, options);
  EXPECT_NEAR(lowered.stiffness, 0.25, 1e-15);
  EXPECT_NEAR(lowered.damping, 2 * 0.3 * 0.5, 1e-15);
  EXPECT_NEAR(bounded_fit({0.04, 0}, options).damping, 2e-4 * 0.2, 1e-15);
  EXPECT_NEAR(bounded_fit({0.04, 5}, options).damping, 4 * 0.2, 1e-15);
  const ModeFit inside = bounded_fit({0.04, 0.1}, options);
  EXPECT_EQ(inside.stiffness, 0.04);
  EXPECT_EQ(inside.damping, 0.1);
  options.discretisation = Discretisation::kDifferences;
  EXPECT_EQ(bounded_fit({4, 1.2}, options).damping, 1.2);
  EXPECT_EQ(bounded_fit({4, 1.2}, options).stiffness, 0.25);
}

}  // namespace
}  // namespace limber::spacetime
