#pragma once

#include <Eigen/Core>
#include <optional>
#include <variant>
#include <vector>

#include "engine/rods/linkage/linkage_model.h"

namespace limber::rods {

/// Quantities that a pin keeps unchanged.
enum class Hold { kMotion, kAngle, kMotionAndAngle };

/// A joint that stays: its position and rotation, its opening angle, or both.
struct JointPin {
  int joint = -1;
  Hold hold = Hold::kMotion;
  /// Target of the joint, with Hold::kMotion or kMotionAndAngle; empty: its present place [length].
  std::optional<Eigen::Vector3d> position = {};
};

/// An opening angle to take and keep [rad], between -pi and pi.
struct AngleSetting {
  int joint = -1;
  double angle = 0;
};

/// The middle of a joint.
struct JointPoint {
  int joint = -1;
  bool operator==(const JointPoint&) const = default;
};

/// A vertex of a segment, 0 .. edges; the outermost ones at a joint lie half an edge beyond it.
struct VertexPoint {
  int segment = -1;
  int vertex = -1;
  bool operator==(const VertexPoint&) const = default;
};

/// A point along a segment: share of the distance from its first vertex to its last, counted in
/// edges, 0 .. 1.
struct ArcPoint {
  int segment = -1;
  double share = 0;
  bool operator==(const ArcPoint&) const = default;
};

/// Pulls a point of the linkage to a position.
struct TargetSpring {
  std::variant<JointPoint, VertexPoint, ArcPoint> at;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [length]
  double stiffness = 0;                                // [force/length], > 0
  bool operator==(const TargetSpring&) const = default;
};

/// Dead loads at a joint: they keep their direction. A moment that does not stay on one axis has no
/// potential; equilibria are found all the same.
struct JointLoad {
  int joint = -1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   // [force]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // [force length]
  double opening_torque = 0;                         // [force length]; > 0 opens
  bool operator==(const JointLoad&) const = default;
};

/// Weight of all rods.
struct Gravity {
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  // [length/time^2]
  double mass_per_length = 0;                              // of a rod [mass/length], >= 0
};

/// Conditions on a linkage during the search for its equilibrium. A plain value.
///
/// A component that no pin, spring or load touches keeps its place in space by itself.
struct Conditions {
  std::vector<JointPin> pins;
  std::vector<AngleSetting> angles;
  std::optional<double> mean_opening_angle;  // of all joints [rad], between -pi and pi
  std::vector<TargetSpring> springs;
  std::vector<JointLoad> loads;
  Gravity gravity;
  /// The shortest that the two edges of a joint may become, as a share of their rest length, in
  /// (0, 1).
  double shortest_joint_edge = 1e-3;

  /// @throws Error naming the member, e.g. pins[2].joint. Joints, segments and vertices that do not
  /// exist: {kOutOfRange}. All others are {kInvalidArgument}: the same joint twice, an angle that
  /// is pinned and set, angles that cannot be reached, a mean of angles that are all prescribed,
  /// numbers that are not finite
  void validate(const LinkageModel& model) const;
};

}  // namespace limber::rods
