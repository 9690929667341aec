#include "engine/spacetime/recovery_energy.h"

#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/fit_dynamics.h"
#include "engine/spacetime/material.h"

namespace limber::spacetime {
namespace {

constexpr double kProximal = 1e-10;  // of the constraints' second derivative

/// f(index of the row, term, frame) over the terms of all rows that have a frame.
template <class Body>
void for_terms(const ForceRows& rows, const Body& body) {
  const int frames = rows.last() + 3;
  for (int row = rows.first(); row <= rows.last(); ++row) {
    for (int term = 0; term <= rows.reach(); ++term) {
      if (row + term < 0 || row + term >= frames) continue;
      body(row, term, row + term);
    }
  }
}

}  // namespace

RecoveryEnergy::RecoveryEnergy(const Eigen::Ref<const Eigen::MatrixXd>& target,
                               const RecoveryOptions& options)
    : target_(target),
      weight_(options.weight),
      column_weight_(options.column_weight),
      driven_(options.driven_frames) {}

ForceRows RecoveryEnergy::rows_of(const RecoveredMotion& at) const {
  return {at.dynamics, static_cast<int>(at.z.cols() - driven_), Beginning::kAnyhow};
}

Eigen::RowVectorXd RecoveryEnergy::force(const ForceRows& rows, const Eigen::MatrixXd& z,
                                         Eigen::Index mode) const {
  Eigen::RowVectorXd result = Eigen::RowVectorXd::Zero(rows.last() - rows.first() + 1);
  for_terms(rows, [&](int row, int term, int frame) {
    result[row - rows.first()] += rows.coefficient(row, term)[mode] * z(mode, driven_ + frame);
  });
  return result;
}

RecoveryEnergies RecoveryEnergy::value(const RecoveredMotion& at) const {
  RecoveryEnergies result;
  const ForceRows rows = rows_of(at);
  for (Eigen::Index k = 0; k < at.z.rows(); ++k)
    result.force += 0.5 * force(rows, at.z, k).squaredNorm();
  result.constraint = 0.5 * (at.mixing * at.z - target_).squaredNorm();
  result.columns = column_energy(at.mixing);
  result.total = result.force + weight_ * result.constraint + column_weight_ * result.columns;
  return result;
}

Eigen::MatrixXd RecoveryEnergy::gradient_of_motion(const RecoveredMotion& at) const {
  Eigen::MatrixXd result = weight_ * (at.mixing.transpose() * (at.mixing * at.z - target_));
  const ForceRows rows = rows_of(at);
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) {
    const Eigen::RowVectorXd f = force(rows, at.z, k);
    for_terms(rows, [&](int row, int term, int frame) {
      result(k, driven_ + frame) += rows.coefficient(row, term)[k] * f[row - rows.first()];
    });
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
  const ForceRows rows = rows_of(at);
  Eigen::MatrixXd band = Eigen::MatrixXd::Zero(rows.reach() * r + 1, r * frames);
  for (Eigen::Index i = 0; i < frames; ++i) {
    for (Eigen::Index k = 0; k < r; ++k) band.col(i * r + k).head(r - k) = gram.col(k).tail(r - k);
  }
  for (Eigen::Index k = 0; k < r; ++k) {
    for_terms(rows, [&](int row, int term, int frame) {
      for (int other = term; other <= rows.reach(); ++other) {
        // Coefficients of frames outside the time line are zero, the band has no place for them.
        if (row + other > rows.last() + 2) break;
        band((other - term) * r, (driven_ + frame) * r + k) +=
            rows.coefficient(row, term)[k] * rows.coefficient(row, other)[k];
      }
    });
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
    FitOptions options{at.dynamics.discretisation, at.dynamics.smoothing};
    options.beginning = Beginning::kAnyhow;
    options.known = {at.dynamics.stiffness[k], at.dynamics.damping[k]};
    const ModeFit fit = fit_mode(at.z.row(k).tail(at.z.cols() - driven_), options);
    at.dynamics.stiffness[k] = fit.stiffness;
    at.dynamics.damping[k] = fit.damping;
  }
}

void RecoveryEnergy::balance(RecoveredMotion& at) const {
  const ForceRows rows = rows_of(at);
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) {
    const double square = at.mixing.col(k).squaredNorm();
    if (square < 1e-200) continue;
    // tau is the column's squared length, E the mode's force energy at tau = 1. The function is E /
    // tau + mu (tau - 1)^2, stationary at tau^2 (tau - 1) = E / (2 mu), convex from 1 on. Newton
    // from above.
    const double at_one = 0.5 * force(rows, at.z, k).squaredNorm() * square;
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
