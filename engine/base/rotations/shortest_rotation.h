#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace limber::rotations {

/// The smallest rotation that takes the direction of `from` to that of `to`; for opposite ones half
/// a turn about some axis across them. Eigen's Quaternion::FromTwoVectors finds that axis by a
/// singular value decomposition, which takes seconds to compile in every file that calls it.
[[nodiscard]] inline Eigen::Quaterniond shortest_rotation(const Eigen::Vector3d& from,
                                                          const Eigen::Vector3d& to) {
  constexpr double kOpposite = 1e-12;
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  if (cosine < -1 + kOpposite) {
    const double half = 0.5 * (1 + std::max(cosine, -1.0));
    const Eigen::Vector3d across = (a - b).unitOrthogonal();
    const Eigen::Vector3d axis = std::sqrt(1 - half) * across;
    return {std::sqrt(half), axis.x(), axis.y(), axis.z()};
  }
  const double s = std::sqrt((1 + cosine) * 2);
  const Eigen::Vector3d axis = a.cross(b) / s;
  return {0.5 * s, axis.x(), axis.y(), axis.z()};
}

}  // namespace limber::rotations
