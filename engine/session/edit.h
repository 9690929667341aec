#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "engine/scene/scene.h"

namespace limber::session {

using Revision = std::uint64_t;  // 0: the scene as opened; every accepted request of edits adds 1

struct AddConstraint {
  scene::Constraint constraint;  // id 0: numbered by the session
};
struct MoveConstraint {
  std::uint64_t id = 0;
  Eigen::Vector3d target = {0, 0, 0};  // [scene length unit], in the constraint's own target kind
};
struct ReplaceConstraint {
  scene::Constraint constraint;  // id names the one to replace
};
struct RemoveConstraint {
  std::uint64_t id = 0;
};
struct SetEnds {
  scene::End first, last;
};
struct SetDynamics {
  scene::Dynamics dynamics;
};
/// From now on this is optimised. What was fitted stays: kMotion freezes it.
struct SetMaterialVariables {
  scene::MaterialVariables variables = scene::MaterialVariables::kMotion;
};
/// Forgets what was fitted: the material of the scene, from which optimisation starts anew.
struct ResetMaterial {};
struct AddKeyframe {
  scene::Keyframe keyframe;  // id 0: numbered by the session
};
/// To another frame, or with another weight; the pose stays.
struct MoveKeyframe {
  std::uint64_t id = 0;
  std::optional<int> frame;
  std::optional<double> weight;
};
struct RemoveKeyframe {
  std::uint64_t id = 0;
};
/// Of linkages and of structures of beams.
struct SetGravity {
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // [m/s^2]
};
struct Undo {};
struct Redo {};

using Edit = std::variant<AddConstraint, MoveConstraint, ReplaceConstraint, RemoveConstraint,
                          SetEnds, SetDynamics, SetMaterialVariables, ResetMaterial, AddKeyframe,
                          MoveKeyframe, RemoveKeyframe, Undo, Redo>;

struct EditReceipt {
  Revision revision = 0;
  std::vector<std::uint64_t> constraint_ids;  // per edit: the constraint it touched, 0 if none
  std::vector<std::uint64_t> keyframe_ids;    // the same of keyframes
  /// Warnings: what was accepted but has no effect as things are after the last edit. Fields are
  /// "edits[i]....".
  std::vector<scene::Issue> issues;
};

}  // namespace limber::session
