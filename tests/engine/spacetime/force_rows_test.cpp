#include "engine/spacetime/force_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "engine/base/random.h"
#include "engine/spacetime/material.h"
#include "engine/spacetime/run_elimination.h"
#include "tests/engine/spacetime/dense_reference.h"

namespace limber::spacetime {
namespace {

constexpr double kFrequencies[] = {1e-9, 1e-5, 0.01, 0.157, 1.0, 2.5, 3.1, 4.0, 9.7};  // omega
constexpr double kRatios[] = {0.1, 0.2, 0.7, 0.999999, 1.0, 1.000001, 1.5, 2.0};       // zeta

ForceStencil stencil_of(double omega, double zeta) {
  return force_stencil(Discretisation::kSampled, omega * omega, 2 * zeta * omega);
}

/// A free motion in time, t in frames: of a swing released at 1, or of both rates of a creep.
double swing_at(double omega, double zeta, double t) {
  const std::complex<double> root = std::sqrt(std::complex<double>(zeta * zeta - 1, 0));
  const std::complex<double> faster = omega * (zeta + root), slower = omega * (zeta - root);
  return (std::exp(-slower * t) + 0.5 * std::exp(-faster * t)).real();
}

double force_at(const ForceStencil& stencil, double before, double now, double next) {
  return stencil.before * before + stencil.centre * now + stencil.next * next;
}

TEST(ForceStencil, OfASampledModeIsZeroForFreeMotionOfAnyFrequency) {
  for (const double omega : kFrequencies) {
    for (const double zeta : kRatios) {
      const ForceStencil stencil = stencil_of(omega, zeta);
      for (const double t : {0.0, 1.0, 7.0}) {
        const double before = swing_at(omega, zeta, t), now = swing_at(omega, zeta, t + 1),
                     next = swing_at(omega, zeta, t + 2);
        const double size = std::abs(stencil.before * before) + std::abs(stencil.centre * now) +
                            std::abs(stencil.next * next);
        EXPECT_LE(std::abs(force_at(stencil, before, now, next)), 1e-13 * size)
            << omega << " " << zeta << " " << t;
      }
    }
  }
}

TEST(ForceStencil, OfASlowUndampedModeIsZeroForItsSwing) {
  for (const double omega : {0.01, 0.5, 2.0, 3.1}) {
    const ForceStencil stencil = stencil_of(omega, 0);
    for (const double t : {0.0, 5.0}) {
      const double force = force_at(stencil, std::cos(omega * t), std::cos(omega * (t + 1)),
                                    std::cos(omega * (t + 2)));
      EXPECT_NEAR(force, 0, 1e-14);
    }
  }
}

TEST(ForceStencil, OfASampledModeGivesAConstantItsStaticForce) {
  for (const double omega : kFrequencies) {
    for (const double zeta : {0.0, 1e-4, 0.2, 1.0, 2.0}) {
      const ForceStencil stencil = stencil_of(omega, zeta);
      EXPECT_NEAR(force_at(stencil, 1, 1, 1), omega * omega,
                  1e-14 * (std::abs(stencil.centre) + omega * omega))
          << omega << " " << zeta;
      EXPECT_GE(stencil.next, stencil.before);
      EXPECT_GE(stencil.before, 0);
    }
  }
}

TEST(ForceStencil, OfAModeThatNothingPullsBackIsThePlainDifference) {
  const ForceStencil rigid = stencil_of(0, 0);
  EXPECT_EQ(rigid.before, 1);
  EXPECT_EQ(rigid.centre, -2);
  EXPECT_EQ(rigid.next, 1);
  for (const double omega : {1e-12, 1e-8, 1e-5}) {
    const ForceStencil stencil = stencil_of(omega, 0.3);
    EXPECT_NEAR(stencil.before, 1, 2 * omega);
    EXPECT_NEAR(stencil.centre, -2, 2 * omega);
    EXPECT_NEAR(stencil.next, 1, 2 * omega);
  }
  // Of d alone: the velocity decays by e^(-d), and a constant costs nothing.
  const ForceStencil slowing = force_stencil(Discretisation::kSampled, 0, 0.4);
  EXPECT_NEAR(slowing.before + slowing.centre + slowing.next, 0, 1e-15);
  EXPECT_NEAR(slowing.before / slowing.next, std::exp(-0.4), 1e-15);
}

/// Both are before z_(i-1) + ... of the same z'' + d z' + lambda z, to first order in the step.
TEST(ForceStencil, OfBothFormsAgreesForSmallSteps) {
  double last = 0;
  for (const double step : {0.1, 0.05, 0.025}) {
    const double omega = 0.8 * step, zeta = 0.3;
    const ForceStencil exact = stencil_of(omega, zeta);
    const ForceStencil published =
        force_stencil(Discretisation::kDifferences, omega * omega, 2 * zeta * omega);
    const auto force = [&](const ForceStencil& stencil) {
      return force_at(stencil, std::sin(1 - step), std::sin(1.0), std::sin(1 + step)) /
             (step * step);
    };
    const double apart = std::abs(force(exact) - force(published));
    if (last > 0) {
      EXPECT_NEAR(apart / last, 0.5, 0.05) << step;
    }
    last = apart;
  }
}

/// An undamped mode at whole turns a frame would stand still for nothing.
TEST(ForceStencil, OfAModeBeyondTheNyquistFrequencyHasABound) {
  for (const double turns : {0.75, 1.0, 1.5, 2.0, 100.0}) {
    const double omega = 2 * std::numbers::pi * turns;
    const ForceStencil stencil = stencil_of(omega, 0);
    EXPECT_LE(stencil.next, 20 * omega * omega) << turns;
    EXPECT_LT(free_growth(stencil).larger, -0.1) << turns;
  }
  const ForceStencil stiffest = force_stencil(Discretisation::kSampled, 1e12, 0);
  EXPECT_EQ(stiffest.before, 0);
  EXPECT_DOUBLE_EQ(stiffest.next, 1e12);
  EXPECT_FALSE(std::isnan(free_growth(stiffest).larger));
  EXPECT_FALSE(std::isnan(free_growth(stiffest).smaller));
}

TEST(ForceStencil, GrowthOfASampledModeIsThatOfItsSolutions) {
  for (const double omega : {0.01, 1.0, 3.0}) {
    for (const double zeta : {0.1, 0.7}) {
      const FreeGrowth growth = free_growth(stencil_of(omega, zeta));
      EXPECT_NEAR(growth.larger, -zeta * omega, 1e-9);
      EXPECT_NEAR(growth.smaller, -zeta * omega, 1e-9);
    }
    const FreeGrowth creep = free_growth(stencil_of(omega, 2));
    EXPECT_NEAR(creep.larger, -omega * (2 - std::sqrt(3.0)), 1e-9);
    EXPECT_NEAR(creep.smaller, -omega * (2 + std::sqrt(3.0)), 1e-9);
  }
}

TEST(ForceSmoothing, IsTheFactorOfSquaresAndDifferences) {
  for (const double tau : {0.1, 1.0, 8.0, 1e3}) {
    const ForceSmoothing smoothing(tau);
    EXPECT_NEAR(smoothing.own + smoothing.following, 1, 1e-12 * tau);
    EXPECT_NEAR(smoothing.own * smoothing.following, -tau * tau, 1e-12 * tau * tau);
    Random random(5);
    Eigen::RowVectorXd forces(9);
    for (double& force : forces) force = random.uniform(-1, 1);
    double energy = forces.squaredNorm();
    for (Eigen::Index i = 0; i + 1 < forces.size(); ++i)
      energy += tau * tau * std::pow(forces[i + 1] - forces[i], 2);
    energy += tau * tau * (std::pow(forces[0], 2) + std::pow(forces[8], 2));
    EXPECT_NEAR(smoothed_forces(forces, tau).squaredNorm(), energy, 1e-12 * energy);
  }
}

ModeDynamics four_modes(Discretisation discretisation, double smoothing) {
  return {Eigen::Vector4d(0, 0.03, 1.7, 40), Eigen::Vector4d(0, 0.02, 2.9, 2.5), discretisation,
          smoothing};
}

/// Against squares of forces and of their differences, which know no rows of four terms.
TEST(ForceRows, HaveTheEnergyOfTheirDefinition) {
  Random random(3);
  for (const int frames : {3, 4, 5, 12}) {
    Eigen::MatrixXd z(4, frames);
    for (double& value : z.reshaped()) value = random.uniform(-1, 1);
    for (const auto form : {Discretisation::kDifferences, Discretisation::kSampled}) {
      for (const double smoothing : {0.0, 0.3, 8.0}) {
        ModeDynamics dynamics = four_modes(form, smoothing);
        const Eigen::Vector4d shares(1, 0.3, 1e-3, 1e-6);
        double expected = 0, shared = 0;
        for (Eigen::Index k = 0; k < 4; ++k) {
          const DenseVector row = z.row(k).transpose().cast<Real>();
          const auto energy =
              static_cast<double>((dense_forces(dynamics, k, frames) * row).squaredNorm() / 2);
          expected += energy;
          shared += shares[k] * energy;
        }
        EXPECT_NEAR(force_energy(dynamics, z), expected, 1e-11 * expected)
            << frames << " " << smoothing;
        EXPECT_GT(expected, 0);
        dynamics.shares = shares;
        EXPECT_NEAR(force_energy(dynamics, z), shared, 1e-11 * shared) << frames;
      }
    }
  }
}

TEST(ForceRows, RefuseSharesOfSomeModes) {
  ModeDynamics dynamics = four_modes(Discretisation::kSampled, 1);
  EXPECT_TRUE(are_force_weights(dynamics));
  dynamics.shares = Eigen::Vector3d(1, 1, 1);
  EXPECT_FALSE(are_force_weights(dynamics));
  dynamics.shares = Eigen::Vector4d(1, 1, 0, 1);
  EXPECT_FALSE(are_force_weights(dynamics));
  dynamics.shares = Eigen::Vector4d(1, 2, 3, 4);
  EXPECT_TRUE(are_force_weights(dynamics));
}

TEST(ForceRows, AreThoseOfThePublishedFormWithoutSmoothing) {
  const ForceRows rows(four_modes(Discretisation::kDifferences, 0), 10);
  EXPECT_EQ(rows.reach(), 2);
  EXPECT_EQ(rows.first(), 0);
  EXPECT_EQ(rows.last(), 7);
  EXPECT_EQ(rows.coefficient(3, 0)[1], 1);
  EXPECT_EQ(rows.coefficient(3, 1)[1], -2 - 0.02 + 0.03);
  EXPECT_EQ(rows.coefficient(3, 2)[1], 1 + 0.02);
  EXPECT_EQ(rows.coefficient(-1, 1)[1], 0);
  EXPECT_EQ(rows.coefficient(8, 1)[1], 0);
}

TEST(ForceRows, NeverReachOutOfTheTimeLine) {
  for (const int frames : {3, 4, 9}) {
    const ForceRows rows(four_modes(Discretisation::kSampled, 4), frames);
    EXPECT_EQ(rows.reach(), 3);
    for (int row = -4; row <= frames; ++row) {
      for (int term = 0; term <= 3; ++term) {
        const bool is_outside = row + term < 0 || row + term >= frames;
        if (is_outside) {
          EXPECT_EQ(rows.coefficient(row, term)[2], 0);
        }
      }
    }
  }
}

TEST(ForceRows, FreeMotionCostsNothingAndALastForceAsMuchAsAFirst) {
  const ModeDynamics dynamics{Eigen::VectorXd::Constant(1, 0.04), Eigen::VectorXd::Constant(1, 0.1),
                              Discretisation::kSampled, 6};
  const auto energy_of = [&](const Eigen::MatrixXd& z) {
    const ForceRows rows(dynamics, static_cast<int>(z.cols()), Beginning::kAnyhow);
    double sum = 0;
    for (int row = rows.first(); row <= rows.last(); ++row) {
      double value = 0;
      for (int term = 0; term <= rows.reach(); ++term)
        if (row + term >= 0 && row + term < z.cols())
          value += rows.coefficient(row, term)[0] * z(0, row + term);
      sum += value * value;
    }
    return sum / 2;
  };
  Eigen::MatrixXd z(1, 40);
  for (int i = 0; i < 40; ++i) z(0, i) = swing_at(0.2, 0.25, i);
  EXPECT_LE(energy_of(z), 1e-25);
  // That it began so is all that it costs.
  const BeginningCost begun = beginning_cost(0.04, 0.1, 6);
  const double expected = (std::pow(begun.place * z(0, 0), 2) +
                           std::pow(begun.lag * z(0, 0) + begun.speed * z(0, 1), 2)) /
                          2;
  EXPECT_NEAR(force_energy(dynamics, z), expected, 1e-12 * expected);
  // Only the first force, only one within, only the last one.
  const ForceStencil stencil = force_stencil(dynamics, 0);
  const auto energy_of_force_in = [&](int frame) {
    Eigen::MatrixXd forced = Eigen::MatrixXd::Zero(1, 40);
    for (int i = 1; i + 1 < 40; ++i) {
      const double force = i == frame ? 1 : 0;
      forced(0, i + 1) =
          (force - stencil.centre * forced(0, i) - stencil.before * forced(0, i - 1)) /
          stencil.next;
    }
    return force_energy(dynamics, forced);
  };
  const double within = energy_of_force_in(20);
  EXPECT_NEAR(within, 0.5 * (1 + 2 * 36), 1e-9);
  EXPECT_NEAR(energy_of_force_in(1), within, 1e-9);
  EXPECT_NEAR(energy_of_force_in(38), within, 1e-9);
}

/// The least force that leads from rest to two neighbouring frames, by eliminating all before.
Eigen::Matrix2d cost_from_rest(const ModeDynamics& dynamics, int frames) {
  const Timeline timeline{frames};
  RunElimination elimination(ForceRows(dynamics, frames), FreeFrames(timeline));
  const RunCost cost = elimination.eliminate({2, frames - 6});
  // z of the two frames behind the run as a body has them that swings freely from there on.
  const ForceStencil stencil = force_stencil(dynamics, 0);
  const int reach = ForceRows(dynamics, frames).reach();
  Eigen::MatrixXd onward = Eigen::MatrixXd::Identity(reach, 2);
  if (reach == 3) onward.row(2) << -stencil.before / stencil.next, -stencil.centre / stencil.next;
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  for (int p = 0; p < reach; ++p) {
    const Eigen::RowVector2d row = cost.rows.row(0).segment(2 * reach * p + reach, reach) * onward;
    sum += row.transpose() * row;
  }
  return sum;
}

TEST(BeginningCost, IsTheLeastForceFromRestLongBefore) {
  for (const double omega : {0.05, 0.157, 1.0, 2.5}) {
    for (const double zeta : {0.1, 0.7, 1.5}) {
      for (const double tau : {0.0, 6.0}) {
        ModeDynamics dynamics{Eigen::VectorXd::Constant(1, omega * omega),
                              Eigen::VectorXd::Constant(1, 2 * zeta * omega),
                              Discretisation::kSampled, tau};
        const Eigen::Matrix2d literal = cost_from_rest(dynamics, 3000);
        const BeginningCost begun = beginning_cost(omega * omega, 2 * zeta * omega, tau);
        const Eigen::RowVector2d first(begun.place, 0), second(begun.lag, begun.speed);
        const Eigen::Matrix2d known = first.transpose() * first + second.transpose() * second;
        if (tau == 0) {
          EXPECT_LE((known - literal).norm(), 1e-7 * literal.norm()) << omega << " " << zeta;
        } else {
          // Smooth forces are counted in the mean of the mode's motion only.
          EXPECT_LE(known.trace(), 2 * literal.trace()) << omega << " " << zeta;
          EXPECT_GE(known.trace(), literal.trace() / 6) << omega << " " << zeta;
        }
      }
    }
  }
}

TEST(BeginningCost, IsNothingWithoutDamping) {
  for (const double omega : {0.0, 0.1, 3.0}) {
    const BeginningCost begun = beginning_cost(omega * omega, 0, 8);
    EXPECT_EQ(begun.place, 0);
    EXPECT_EQ(begun.lag, 0);
    EXPECT_EQ(begun.speed, 0);
  }
  // Where nothing pulls back only a velocity costs.
  const BeginningCost slowing = beginning_cost(0, 0.2, 0);
  EXPECT_EQ(slowing.place, 0);
  EXPECT_NEAR(slowing.lag, -slowing.speed, 1e-12);
  EXPECT_GT(slowing.speed, 0);
}

}  // namespace
}  // namespace limber::spacetime
