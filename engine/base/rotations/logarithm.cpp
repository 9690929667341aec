#include "engine/base/rotations/logarithm.h"

#include <cmath>
#include <numbers>

namespace limber::rotations {

Eigen::Vector3d logarithm(const Eigen::Quaterniond& rotation) {
  // q and -q are the same rotation; w >= 0 is the shorter rotation.
  const double sign = rotation.w() < 0 ? -1 : 1;
  const Eigen::Vector3d v = sign * rotation.vec();
  const double sine = v.stableNorm();
  if (sine == 0) return Eigen::Vector3d::Zero();
  return v * (2 * std::atan2(sine, sign * rotation.w()) / sine);
}

Eigen::Vector3d logarithm(const Eigen::Matrix3d& rotation) {
  return logarithm(Eigen::Quaterniond(rotation).normalized());
}

Eigen::Vector3d nearest_branch(const Eigen::Vector3d& principal, const Eigen::Vector3d& reference) {
  constexpr double kTurn = 2 * std::numbers::pi;
  constexpr double kIdentity = 1e-13;
  const double angle = principal.norm();
  if (angle < kIdentity) {
    const double length = reference.norm();
    const double turns = std::round(length / kTurn);
    if (turns == 0) return principal;
    return reference * (turns * kTurn / length);
  }
  const Eigen::Vector3d axis = principal / angle;
  const double turns = std::round((axis.dot(reference) - angle) / kTurn);
  return turns == 0 ? principal : Eigen::Vector3d(axis * (angle + turns * kTurn));
}

Eigen::Vector3d logarithm_near(const Eigen::Quaterniond& rotation,
                               const Eigen::Vector3d& reference) {
  return nearest_branch(logarithm(rotation), reference);
}

}  // namespace limber::rotations
