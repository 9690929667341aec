#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "engine/scene/scene.h"

namespace limber::session {

/// The primitive changes a document is made of. Applying one yields its inverse: undo keeps these,
/// never scenes.
struct ConstraintChange {
  std::uint64_t id = 0;
  std::optional<scene::Constraint> value;  // the new value; none: the constraint is removed
};
struct TargetChange {
  std::uint64_t id = 0;
  Eigen::Vector3d target = {0, 0, 0};
};
struct EndsChange {
  scene::End first = scene::End::kFree, last = scene::End::kFree;
};
struct DynamicsChange {
  scene::Dynamics dynamics;
};

/// A keyframe comes, goes or is replaced.
struct KeyframeChange {
  std::uint64_t id = 0;
  std::optional<scene::Keyframe> value;  // the new value; none: the keyframe is removed
};
struct KeyframeShift {
  std::uint64_t id = 0;
  int frame = 0;
  double weight = 0;
};

/// The optimised variables and the epoch (last reset): a fitted material belongs to one.
struct MaterialChange {
  scene::MaterialVariables variables = scene::MaterialVariables::kMotion;
  std::uint64_t epoch = 0;
};

/// Paths of the fixed nodes, 3 fixed x N in their order [scene unit]; null: as in the scene.
using PinPaths = std::shared_ptr<const Eigen::MatrixXd>;
struct PinsChange {
  PinPaths paths;
};

using Change = std::variant<ConstraintChange, TargetChange, EndsChange, DynamicsChange,
                            MaterialChange, KeyframeChange, KeyframeShift, PinsChange>;
using ChangeGroup = std::vector<Change>;  // in the order they are to be applied

/// Differences from the state that the solver has read last. Grows with the number of touched
/// things, not of edits: this is how a storm of edits is coalesced.
struct Touched {
  enum class How { kTargetOnly, kAnything };

  std::map<std::uint64_t, How> constraints;
  bool ends = false;
  bool dynamics = false;
  bool material = false;
  bool keyframes = false;
  bool pins = false;

  void note(const Change& change);
  void add(const Touched& more);
  [[nodiscard]] bool empty() const {
    return constraints.empty() && !ends && !dynamics && !keyframes && !pins;
  }
};

}  // namespace limber::session
