#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace limber::beams {

/// A rotation as exp(w^x) exp(twist e^x): a twist about an axis e, then a swing about some axis
/// across it.
struct SwingTwist {
  double twist = 0;                                           // in [-pi, pi] [rad]
  Eigen::Quaterniond swing = Eigen::Quaterniond::Identity();  // w >= 0, no component along e

  /// After a swing by half a turn, any twist gives the same rotations: cosines of half the swing
  /// below this are taken for that.
  static constexpr double kHalfTurn = 1e-6;
  [[nodiscard]] bool swings_by_half_a_turn() const { return swing.w() < kHalfTurn; }
};

/// @param rotation  by the axes of which e is one
/// @param axis      e, from 0
/// @param expected  the twist of a rotation that swings by half a turn [rad]
[[nodiscard]] SwingTwist swing_and_twist(const Eigen::Quaterniond& rotation, int axis,
                                         double expected);

/// Half of a swing. It takes e to the axis of the spins that change the twist fastest; spins across
/// that axis keep the twist exactly, however far they go (NOTATION.md).
[[nodiscard]] Eigen::Quaterniond half_of(const Eigen::Quaterniond& swing);

/// exp(twist e^x), by axes of which e is one.
[[nodiscard]] Eigen::Quaterniond twist_about(int axis, double twist);

/// A quaternion by axes (columns) in place of space.
[[nodiscard]] Eigen::Quaterniond quaternion_by_axes(const Eigen::Matrix3d& axes,
                                                    const Eigen::Quaterniond& q);

}  // namespace limber::beams
