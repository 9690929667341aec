#pragma once

#include <Eigen/Core>

#include "engine/spacetime/fit_dynamics.h"

namespace limber::spacetime {

/// fit_mode() of a sampled mode.
/// @param signals  of one mode, a row a force: acceleration z_(i+1) - 2 z_i + z_(i-1), velocity
/// z_(i+1) - z_i, position z_i; or all three smoothed alike
/// @param first  z_0 and z_1, on the scale of the signals
[[nodiscard]] ModeFit fit_sampled(const Eigen::MatrixX3d& signals, const Eigen::Vector2d& first,
                                  const FitOptions& options);

}  // namespace limber::spacetime
