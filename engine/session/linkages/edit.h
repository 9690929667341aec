#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "engine/scene/linkage.h"
#include "engine/session/core/values.h"

namespace limber::session {

/// Edits of a linkage by clients. Joints and segments are numbered as in scene::Linkage.

struct PinJoint {
  int joint = 0;
  std::optional<scene::Held> held;               // nothing: the joint is released
  std::optional<Eigen::Vector3d> position = {};  // as scene::JointPin has it
};
/// An angle that the joint is to have from now on; nothing: it is free to open.
struct SetJointAngle {
  int joint = 0;
  std::optional<double> angle;  // [rad]
};
/// The mean opening angle: the linkage is deployed to it, step by step; nothing: it is free.
struct SetMeanAngle {
  std::optional<double> angle;  // [rad]
};
struct AddTarget {
  scene::LinkageTarget target;  // id 0: numbered by the session
};
struct MoveTarget {
  std::uint64_t id = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [scene length unit]
};
struct ReplaceTarget {
  scene::LinkageTarget target;  // id names the one to replace
};
struct RemoveTarget {
  std::uint64_t id = 0;
};
/// Replaces what loads the joint; zeros take it away.
struct SetJointLoad {
  scene::JointLoad load;
};

/// Rest lengths of all segments [scene length unit]; none: those of the scene.
struct SetSegmentLengths {
  Eigen::VectorXd lengths;
};

/// Rest lengths of all edges, in place of those of segments; see LinkageConditions. None: those of
/// the scene. Either of the two edits puts an end to what the other had set.
struct SetEdgeLengths {
  Eigen::VectorXd lengths;
};
/// Of all segments; none: 1.
struct SetSectionScales {
  Eigen::VectorXd scales;
};

/// The erection that a design stores with its sizes. Edits of sizes put an end to it.
struct SetErection {
  std::shared_ptr<const scene::LinkageErection> erection;  // null: not known
};

using LinkageEdit =
    std::variant<PinJoint, SetJointAngle, SetMeanAngle, AddTarget, MoveTarget, ReplaceTarget,
                 RemoveTarget, SetJointLoad, SetGravity, SetSegmentLengths, SetEdgeLengths,
                 SetSectionScales, SetErection, Undo, Redo>;

}  // namespace limber::session
