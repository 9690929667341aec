#pragma once

#include <Eigen/Core>

#include "engine/spacetime/recovery.h"

namespace limber::spacetime {

/// RecoveryStart::kSpectrum; z = S^T z-bar.
[[nodiscard]] RecoveredMotion spectrum_start(const Eigen::MatrixXd& target,
                                             const Eigen::VectorXd& eigenvalues, int modes);

/// RecoveryStart::kPrincipalComponents; z = S^T z-bar, Lambda and D are zero.
[[nodiscard]] RecoveredMotion principal_start(const Eigen::MatrixXd& target, int modes);

}  // namespace limber::spacetime
