#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace limber::rotations {

/// The principal logarithm: theta with exp(theta^x) the rotation, |theta| <= pi [rad].
/// @pre rotation has unit norm
[[nodiscard]] Eigen::Vector3d logarithm(const Eigen::Quaterniond& rotation);
[[nodiscard]] Eigen::Vector3d logarithm(const Eigen::Matrix3d& rotation);

/// The theta nearest to `reference` for which exp(theta^x) is the rotation (all of these differ by
/// full turns along the axis). If the rotation is the identity to 1e-13, any axis is possible: the
/// reference's own is taken.
[[nodiscard]] Eigen::Vector3d logarithm_near(const Eigen::Quaterniond& rotation,
                                             const Eigen::Vector3d& reference);
/// The same for a rotation whose principal logarithm is known.
[[nodiscard]] Eigen::Vector3d nearest_branch(const Eigen::Vector3d& principal,
                                             const Eigen::Vector3d& reference);

}  // namespace limber::rotations
