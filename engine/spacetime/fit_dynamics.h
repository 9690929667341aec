#pragma once

#include <Eigen/Core>
#include <limits>

namespace limber::spacetime {

/// Stiffness and damping of one mode, as in ModeDynamics.
struct ModeFit {
  double stiffness = 0;  // lambda [1/frame^2], >= 0
  double damping = 0;    // d [1/frame], >= 0
};

/// The dynamics that need least force for a given motion of one mode: minimises
///   sum_i (z_(i+1) - 2 z_i + z_(i-1) + d (z_(i+1) - z_i) + lambda z_i)^2
/// over 0 <= lambda <= max_stiffness and d >= 0 (paper: space-time editing, eq. 17a), jointly and
/// exactly. The paper solves for one after the other and clips (section 5.4), which is not the
/// minimum.
///
/// Where the motion does not tell the two apart the answer is still one: what has no effect is 0
/// (both for z = 0 and for a constant z, for fewer than three frames too); where velocity and
/// displacement are proportional (z geometric) one of the two is 0, damping where both would do.
/// Does not depend on the scale of z.
/// @param z              N, one number a frame
/// @param max_stiffness  [1/frame^2], >= 0
/// @throws Error{kInvalidArgument} naming z for numbers that are not finite
[[nodiscard]] ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z,
                               double max_stiffness = std::numeric_limits<double>::infinity());

}  // namespace limber::spacetime
