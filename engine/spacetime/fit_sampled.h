#pragma once

#include <Eigen/Core>

#include "engine/spacetime/fit_dynamics.h"

namespace limber::spacetime {

/// fit_mode() of a sampled mode.
/// @param signals  of one mode, a row a force: acceleration z_(i+1) - 2 z_i + z_(i-1), velocity
/// z_(i+1) - z_i, position z_i; or all three smoothed alike
[[nodiscard]] ModeFit fit_sampled(const Eigen::MatrixX3d& signals, const FitOptions& options);

}  // namespace limber::spacetime
