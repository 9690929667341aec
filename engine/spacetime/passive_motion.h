#pragma once

#include <Eigen/Core>

#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// What a body does without control forces under accelerations that act on it, as those of an
/// animated base do.
struct PassiveMotion {
  Eigen::MatrixXd z;  // r x N; zero in frames that the ends hold
  double energy = 0;  // E_f of what the ends take that no motion can: 0 where they are free
};

/// The motion of least E_f = 1/2 |A z - B g|^2. For any other one E_f is `energy` + 1/2 |A (z -
/// passive)|^2, since the gradient vanishes here: what is optimised is the difference.
/// @param load  g, r x N, [1/frame^2]: z'' + d z' + lambda z = g without control forces. Of the end
/// frames it counts in a cycle alone: elsewhere no force acts there
[[nodiscard]] PassiveMotion passive_motion(const ModeDynamics& dynamics, const Timeline& timeline,
                                           const Eigen::Ref<const Eigen::MatrixXd>& load);

}  // namespace limber::spacetime
