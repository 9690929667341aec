#pragma once

#include <array>
#include <variant>
#include <vector>

#include "engine/beams/model/beam_model.h"
#include "engine/session/core/values.h"

namespace limber::session {

/// What a client may do to a structure of beams. Nodes and elements are numbered as in the model.

/// Replaces the support of the node, which goes back to where it was drawn in the directions that
/// are fixed; nothing fixed: the support is gone. Motions of the node stay.
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
/// Holds directions of a node where they are, by the axes of what holds it already; others stay as
/// they are.
struct HoldNode {
  int node = 0;
  std::array<bool, 3> translations{true, true, true};
  bool rotations = true;
};
/// Replaces what loads the node; zeros take it away.
struct SetNodeLoad {
  beams::NodalLoad load;
};
/// Replaces what is distributed over the element; zeros take it away.
struct SetElementLoad {
  beams::DistributedLoad load;
};
/// Acts while what the request changes is brought on, and is gone in the end.
struct PushNode {
  beams::NodalLoad load;
};

using BeamEdit = std::variant<SetSupport, MoveNode, ReleaseNode, HoldNode, SetNodeLoad,
                              SetElementLoad, PushNode, SetGravity, Undo, Redo>;

}  // namespace limber::session
