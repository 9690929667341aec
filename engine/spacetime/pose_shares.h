#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// The share of a pose that a motion has in each frame, as it reaches the pose and leaves it again.
/// A pose moves like one mode. Its frequency and damping are the averages over the pose's modes,
/// weighted by their kinetic energies: lambda = |z|^2 / sum z_k^2 / lambda_k. Its motion is the
/// optimum of control forces that has the pose in its own frame and none of it in the frames of the
/// others. Weights are those of the keyframes, so that a soft one has less than 1 in its frame.
/// @param pose  index into keyframes; @param dynamics  of the first modes of z
/// @returns N
/// @throws Error{kInvalidArgument} as Solver, Error{kNumerical} for a share that is not finite
[[nodiscard]] Eigen::VectorXd pose_share(std::size_t pose,
                                         const std::vector<KeyframeConstraint>& keyframes,
                                         const ModeDynamics& dynamics, const Timeline& timeline);

}  // namespace limber::spacetime
