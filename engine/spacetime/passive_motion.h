#pragma once

#include <Eigen/Core>

#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// The motion of a body without control forces under given accelerations, such as those of an
/// animated base.
struct PassiveMotion {
  Eigen::MatrixXd z;  // r x N; zero in frames that the ends hold
  double energy = 0;  // E_f of what the ends take that no motion can: 0 where they are free
};

/// The motion of least E_f = 1/2 |A z - B g|^2. For any other motion E_f is `energy` + 1/2 |A (z -
/// passive)|^2, since the gradient vanishes here: the difference is optimised.
/// @param load  g, r x N, [1/frame^2]: z'' + d z' + lambda z = g without control forces. In end
/// frames it counts only in a cycle: elsewhere no force acts there
[[nodiscard]] PassiveMotion passive_motion(const ModeDynamics& dynamics, const Timeline& timeline,
                                           const Eigen::Ref<const Eigen::MatrixXd>& load);

}  // namespace limber::spacetime
