#pragma once

#include <array>
#include <variant>
#include <vector>

#include "engine/beams/model/beam_model.h"
#include "engine/session/core/values.h"

namespace limber::session {

/// Edits of a structure of beams by clients. Nodes and elements are numbered as in the model.

/// Replaces the support of the node, which returns to its drawn position in the fixed directions.
/// If nothing is fixed, the support is removed. Motions of the node stay.
struct SetSupport {
  beams::BeamSupport support;
};
/// Brings a node somewhere, whether a support held it or not: the directions that are given are
/// held there from now on, the others stay as they are.
struct MoveNode {
  beams::PrescribedMotion motion;
};
/// Takes the node's support and motion away.
struct ReleaseNode {
  int node = 0;
};
/// Holds directions of a node at their current values, in the axes of its present support or
/// motion; the other directions stay.
struct HoldNode {
  int node = 0;
  std::array<bool, 3> translations{true, true, true};
  bool rotations = true;
};
/// Replaces what loads the node; zeros take it away.
struct SetNodeLoad {
  beams::NodalLoad load;
};
/// Replaces the distributed load of the element; zeros remove it.
struct SetElementLoad {
  beams::DistributedLoad load;
};
/// Acts while the changes of the request are applied, and is removed at the end.
struct PushNode {
  beams::NodalLoad load;
};

using BeamEdit = std::variant<SetSupport, MoveNode, ReleaseNode, HoldNode, SetNodeLoad,
                              SetElementLoad, PushNode, SetGravity, Undo, Redo>;

}  // namespace limber::session
