#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "engine/scene/scene.h"
#include "engine/session/bodies/changes.h"
#include "engine/session/core/values.h"

namespace limber::session {

struct AddConstraint {
  scene::Constraint constraint;  // id 0: numbered by the session
};
struct MoveConstraint {
  std::uint64_t id = 0;
  Eigen::Vector3d target = {0, 0, 0};  // in the constraint's own kind and unit
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
/// The discretisation stays where none is requested.
struct SetDynamics {
  scene::DynamicsRequest dynamics;
};
/// From now on this is optimised. Fitted values stay: kMotion freezes them.
struct SetMaterialVariables {
  scene::MaterialVariables variables = scene::MaterialVariables::kMotion;
};
/// Discards the fit: optimisation starts anew from the material of the scene.
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

/// Animated pins in place of the scene's base motion.
struct SetPins {
  PinPaths paths;  // null: the scene's base motion again
};

using BodyEdit = std::variant<AddConstraint, MoveConstraint, ReplaceConstraint, RemoveConstraint,
                              SetEnds, SetDynamics, SetMaterialVariables, ResetMaterial,
                              AddKeyframe, MoveKeyframe, RemoveKeyframe, SetPins, Undo, Redo>;

}  // namespace limber::session
