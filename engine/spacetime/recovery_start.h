#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/spacetime/recovery.h"

namespace limber::spacetime {

/// RecoveryStart::kSpectrum; z = S^T z-bar.
[[nodiscard]] RecoveredMotion spectrum_start(const Eigen::MatrixXd& target,
                                             const Eigen::VectorXd& eigenvalues, int modes);

/// S: principal components of the motion; z = S^T z-bar, Lambda and D are zero.
[[nodiscard]] RecoveredMotion principal_start(const Eigen::MatrixXd& target, int modes);

/// The least-squares fit of a linear oscillator with dense A and B to a motion: z_(i+1) - 2 z_i +
/// z_(i-1) = -A z_i - B (z_(i+1) - z_i).
struct CoupledOscillator {
  Eigen::MatrixXd stiffness, damping;  // A, B, r x r [1/frame^2], [1/frame]
  double force = 0;                    // half the sum of squares that is left
};
/// @param z  r x N
/// @param driven  frames at the beginning that do not count
/// @returns nothing for too few frames
[[nodiscard]] std::optional<CoupledOscillator> fit_oscillator(const Eigen::MatrixXd& z,
                                                              Eigen::Index driven);

/// The same subspace as principal_start(), in the modes of the oscillator that is fitted to the
/// motion there: near-equal frequencies come apart, which principal components mix.
/// @returns nothing where the oscillator has no basis of modes in double precision
[[nodiscard]] std::optional<RecoveredMotion> separated_start(const Eigen::MatrixXd& target,
                                                             int modes, Eigen::Index driven);

}  // namespace limber::spacetime
