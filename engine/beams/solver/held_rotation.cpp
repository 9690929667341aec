#include "engine/beams/solver/held_rotation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/rotations/logarithm.h"
#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/swing_twist.h"

namespace limber::beams::detail {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kSameAttitude = 1e-6;  // [rad]

/// Angle of the part of a rotation about one axis; zero if it is half a turn about another.
double angle_about(int axis, const Quaterniond& q) { return 2 * std::atan2(q.vec()[axis], q.w()); }

/// The rotation is the first times one about the axis: no component of the first is along it.
Vector3d before_turning_about(int axis, const Quaterniond& q) {
  const Quaterniond about = rotation_by(angle_about(axis, q) * Vector3d::Unit(axis));
  Vector3d swing = rotations::logarithm((q * about.conjugate()).normalized());
  swing[axis] = 0;
  return swing;
}

}  // namespace

HeldRotation::HeldRotation(const std::array<bool, 3>& held, const Eigen::Matrix3d& axes,
                           const Quaterniond& start, const Vector3d& target,
                           const std::optional<Vector3d>& known)
    : count_(static_cast<int>(std::count(held.begin(), held.end(), true))), axes_(axes) {
  if (count_ == 0) return;
  if (count_ < 3)
    axis_ = static_cast<int>(std::find(held.begin(), held.end(), count_ == 1) - held.begin());
  Vector3d first = known.value_or(Vector3d::Zero());
  to_ = target;
  for (int k = 0; k < 3; ++k) {
    if (!held[static_cast<std::size_t>(k)]) first[k] = to_[k] = 0;
  }
  const Quaterniond q = quaternion_by_axes(axes_, start);
  const Vector3d off = missing(q, first);
  if (off.norm() < kSameAttitude) {
    from_ = first;
  } else if (count_ == 1) {
    from_[axis_] = swing_and_twist(q, axis_, first[axis_]).twist;
  } else if (count_ == 3) {
    base_ = q;
    to_ = rotations::logarithm((rotation_by(to_) * q.conjugate()).normalized());
  } else {
    // exp(psi e_k) exp(w) is exp(the swing) exp(psi e_k), with w the swing turned back by psi.
    const double turned = angle_about(axis_, q);
    from_ = rotation_by(-turned * Vector3d::Unit(axis_)) * before_turning_about(axis_, q);
    from_[axis_] = 0;
  }
}

Vector3d HeldRotation::missing(const Quaterniond& q, const Vector3d& target) const {
  if (count_ == 1) return missing_twist(q, target[axis_]) * Vector3d::Unit(axis_);
  if (count_ == 2) return -before_turning_about(axis_, q * rotation_by(-target));
  return rotations::logarithm((rotation_by(target) * base_ * q.conjugate()).normalized());
}

/// A spin by d about the axis that goes along with half the swing changes the twist by t, with
/// tan(d / 2) = tan(t / 2) cos(swing / 2).
double HeldRotation::missing_twist(const Quaterniond& q, double target) const {
  const SwingTwist parts = swing_and_twist(q, axis_, target);
  if (parts.swings_by_half_a_turn()) {
    const Quaterniond left = q * twist_about(axis_, target).conjugate();
    return -2 * std::asin((left.w() < 0 ? -1 : 1) * left.vec()[axis_]);
  }
  const double turn = std::remainder(target - parts.twist, 2 * std::numbers::pi);
  return 2 * std::atan2(std::sin(0.5 * turn) * parts.swing.w(), std::cos(0.5 * turn));
}

Vector3d HeldRotation::spin(const Quaterniond& rotation, double s) const {
  if (count_ == 0) return Vector3d::Zero();
  return missing(quaternion_by_axes(axes_, rotation), from_ + s * (to_ - from_));
}

HeldRotation HeldRotation::resting_at(double s) const {
  HeldRotation result = *this;
  result.from_ = result.to_ = from_ + s * (to_ - from_);
  return result;
}

}  // namespace limber::beams::detail
