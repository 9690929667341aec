#include "engine/spacetime/recovery_energy.h"

#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/fit_dynamics.h"
#include "engine/spacetime/material.h"

namespace limber::spacetime {
namespace {

constexpr double kProximal = 1e-10;  // of the constraints' second derivative

std::array<double, 3> row_of(const ModeDynamics& dynamics, Eigen::Index mode) {
  const double lambda = dynamics.stiffness[mode], d = dynamics.damping[mode];
  return {1, -2 - d + lambda, 1 + d};
}

}  // namespace

RecoveryEnergy::RecoveryEnergy(const Eigen::Ref<const Eigen::MatrixXd>& target,
                               const RecoveryOptions& options)
    : target_(target),
      weight_(options.weight),
      column_weight_(options.column_weight),
      driven_(options.driven_frames) {}

Eigen::RowVectorXd RecoveryEnergy::force(const RecoveredMotion& at, Eigen::Index mode) const {
  const auto row = row_of(at.dynamics, mode);
  const Eigen::Index rows = at.z.cols() - 2 - driven_;
  const auto z = at.z.row(mode);
  return row[0] * z.segment(driven_, rows) + row[1] * z.segment(driven_ + 1, rows) +
         row[2] * z.segment(driven_ + 2, rows);
}

RecoveryEnergies RecoveryEnergy::value(const RecoveredMotion& at) const {
  RecoveryEnergies result;
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) result.force += 0.5 * force(at, k).squaredNorm();
  result.constraint = 0.5 * (at.mixing * at.z - target_).squaredNorm();
  result.columns = column_energy(at.mixing);
  result.total = result.force + weight_ * result.constraint + column_weight_ * result.columns;
  return result;
}

Eigen::MatrixXd RecoveryEnergy::gradient_of_motion(const RecoveredMotion& at) const {
  Eigen::MatrixXd result = weight_ * (at.mixing.transpose() * (at.mixing * at.z - target_));
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) {
    const auto row = row_of(at.dynamics, k);
    const Eigen::RowVectorXd f = force(at, k);
    for (Eigen::Index part = 0; part < 3; ++part)
      result.row(k).segment(driven_ + part, f.size()) += row[static_cast<std::size_t>(part)] * f;
  }
  return result;
}

Eigen::MatrixXd RecoveryEnergy::gradient_of_mixing(const RecoveredMotion& at) const {
  return weight_ * ((at.mixing * at.z - target_) * at.z.transpose()) +
         column_weight_ * column_gradient(at.mixing);
}

BandedCholesky RecoveryEnergy::factor_motion(const RecoveredMotion& at) const {
  const Eigen::Index r = at.z.rows(), frames = at.z.cols();
  const Eigen::MatrixXd gram = weight_ * (at.mixing.transpose() * at.mixing);
  Eigen::MatrixXd band = Eigen::MatrixXd::Zero(2 * r + 1, r * frames);
  for (Eigen::Index i = 0; i < frames; ++i) {
    for (Eigen::Index k = 0; k < r; ++k) band.col(i * r + k).head(r - k) = gram.col(k).tail(r - k);
  }
  for (Eigen::Index k = 0; k < r; ++k) {
    const auto row = row_of(at.dynamics, k);
    for (Eigen::Index i = driven_; i + 2 < frames; ++i) {
      for (Eigen::Index a = 0; a < 3; ++a) {
        for (Eigen::Index b = a; b < 3; ++b) {
          band((b - a) * r, (i + a) * r + k) +=
              row[static_cast<std::size_t>(a)] * row[static_cast<std::size_t>(b)];
        }
      }
    }
  }
  // Scaled by the largest column: independent ones may all have been lost.
  const double scale = std::max(gram.diagonal().maxCoeff(), 1e-100);
  band.row(0).array() += kProximal * scale;
  BandedCholesky result;
  LIMBER_DEMAND(result.factor(std::move(band)));
  return result;
}

void RecoveryEnergy::fit_motion(RecoveredMotion& at) const {
  const BandedCholesky cholesky = factor_motion(at);
  BandedCholesky::Columns step(at.z.size(), 1);
  // The second time takes out what the proximal term held back, and rounding.
  for (int round = 0; round < 2; ++round) {
    step.col(0) = gradient_of_motion(at).reshaped();
    cholesky.solve(step);
    at.z -= step.col(0).reshaped(at.z.rows(), at.z.cols());
  }
}

void RecoveryEnergy::fit_dynamics(RecoveredMotion& at) const {
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) {
    const ModeFit fit = fit_mode(at.z.row(k).tail(at.z.cols() - driven_));
    at.dynamics.stiffness[k] = fit.stiffness;
    at.dynamics.damping[k] = fit.damping;
  }
}

void RecoveryEnergy::balance(RecoveredMotion& at) const {
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) {
    const double square = at.mixing.col(k).squaredNorm();
    if (square < 1e-200) continue;
    // With the column's squared length tau, and E the mode's force energy where it is 1:
    // E / tau + mu (tau - 1)^2, stationary at tau^2 (tau - 1) = E / (2 mu), convex from 1 on;
    // Newton from above.
    const double at_one = 0.5 * force(at, k).squaredNorm() * square;
    const double cubic_value = at_one / (2 * column_weight_);
    double tau = 1 + std::cbrt(cubic_value);
    for (int round = 0; round < 100; ++round) {
      const double step = (tau * tau * (tau - 1) - cubic_value) / (tau * (3 * tau - 2));
      tau = std::max(1.0, tau - step);
      if (step <= 1e-15 * tau) break;
    }
    const double scale = std::sqrt(tau / square);
    at.mixing.col(k) *= scale;
    at.z.row(k) /= scale;
  }
}

}  // namespace limber::spacetime
