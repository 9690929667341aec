#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>

namespace limber::beams::detail {

/// Rotation of a node about the axes that supports and motions hold (see PrescribedMotion). Its
/// path goes from s = 0, the present rotation, to s = 1, the target. A rotation is measured by its
/// state alone: motion about free axes along the path leaves nothing behind. About one axis that is
/// held alone it is the twist that swing_and_twist() finds.
class HeldRotation {
 public:
  /// Nothing is held.
  HeldRotation() = default;
  /// @param held    which of the axes
  /// @param axes    columns: those of the node's unknowns
  /// @param start   rotation from rest at s = 0
  /// @param target  rotation vector at s = 1, by axes; free components do not count [rad]
  /// @param known   rotation vector at s = 0, by axes, where it is known to be of more than half a
  ///                turn; taken where it is true of the start
  HeldRotation(const std::array<bool, 3>& held, const Eigen::Matrix3d& axes,
               const Eigen::Quaterniond& start, const Eigen::Vector3d& target,
               const std::optional<Eigen::Vector3d>& known);

  /// Remaining rotation to s: spins about BeamStructure::spin_axes, zero where they are free [rad].
  [[nodiscard]] Eigen::Vector3d spin(const Eigen::Quaterniond& rotation, double s) const;

  /// From s = 0 to 1 [rad].
  [[nodiscard]] double angle() const { return (to_ - from_).norm(); }
  /// As it is at s, for all of the path.
  [[nodiscard]] HeldRotation resting_at(double s) const;

 private:
  /// For two or three axes.
  [[nodiscard]] Eigen::Vector3d missing(const Eigen::Quaterniond& by_axes,
                                        const Eigen::Vector3d& target) const;

  [[nodiscard]] double missing_twist(const Eigen::Quaterniond& by_axes, double target) const;

  int count_ = 0;  // of axes that are held
  int axis_ = 0;   // the free one of two, or the one that is held alone
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();
  Eigen::Quaterniond base_ = Eigen::Quaterniond::Identity();  // for three: base of the vectors
  Eigen::Vector3d from_ = Eigen::Vector3d::Zero(), to_ = Eigen::Vector3d::Zero();
};

}  // namespace limber::beams::detail
