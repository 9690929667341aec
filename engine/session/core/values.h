#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/scene/issue.h"

namespace limber::session {

enum class State { kBuilding, kReady, kFailed, kClosed };

struct Progress {
  std::string stage;
  double fraction = 0;  // of the whole, in [0, 1]
};

/// 0: the scene as opened; every accepted request of edits adds 1.
using Revision = std::uint64_t;

struct EditReceipt {
  Revision revision = 0;
  std::vector<std::uint64_t> constraint_ids;  // per edit: the constraint it touched, 0 if none
  std::vector<std::uint64_t> keyframe_ids;    // the same of keyframes
  /// Warnings: accepted edits that have no effect in the state after the last edit. Fields are
  /// "edits[i]....".
  std::vector<scene::Issue> issues;
};

/// Edits of every kind: back to the step before the last, and on again.
enum class Whose {
  kOwn,     // the author's own, see StepChoice
  kAnyone,  // the newest
};
struct Undo {
  Whose whose = Whose::kOwn;
};
struct Redo {
  Whose whose = Whose::kOwn;
};
/// Of structures that have weight.
struct SetGravity {
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // [m/s^2]
};

}  // namespace limber::session
