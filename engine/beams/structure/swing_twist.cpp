#include "engine/beams/structure/swing_twist.h"

#include <cmath>
#include <numbers>

namespace limber::beams {

SwingTwist swing_and_twist(const Eigen::Quaterniond& rotation, int axis, double expected) {
  const double along = rotation.vec()[axis];
  SwingTwist result;
  if (std::hypot(along, rotation.w()) < SwingTwist::kHalfTurn)
    result.twist = expected;
  else if (along != 0 || rotation.w() < 0)
    result.twist = std::remainder(2 * std::atan2(along, rotation.w()), 2 * std::numbers::pi);
  result.swing = rotation * twist_about(axis, result.twist).conjugate();
  if (result.swing.w() < 0) result.swing.coeffs() *= -1;
  result.swing.vec()[axis] = 0;  // but for rounding
  result.swing.normalize();
  return result;
}

Eigen::Quaterniond half_of(const Eigen::Quaterniond& swing) {
  Eigen::Quaterniond half = swing;
  half.w() += 1;
  return half.normalized();
}

Eigen::Quaterniond twist_about(int axis, double twist) {
  Eigen::Quaterniond result;
  result.w() = std::cos(0.5 * twist);
  result.vec() = std::sin(0.5 * twist) * Eigen::Vector3d::Unit(axis);
  return result;
}

Eigen::Quaterniond quaternion_by_axes(const Eigen::Matrix3d& axes, const Eigen::Quaterniond& q) {
  Eigen::Quaterniond result;
  result.w() = q.w();
  result.vec() = axes.transpose() * q.vec();
  return result;
}

}  // namespace limber::beams
