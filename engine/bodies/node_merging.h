#pragma once

#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Per node its representative: itself, or the lowest representative not farther than `tolerance`
/// from it.
///
/// Nodes are visited in their order, and only those that find no representative become one, so that
/// chains of close nodes do not collapse into one. Deterministic; O(n) for any distribution of
/// nodes.
/// @param nodes      finite
/// @param tolerance  [m], >= 0; 0 merges exact copies
[[nodiscard]] std::vector<int> merge_near_nodes(const NodePositions& nodes, double tolerance);

}  // namespace limber::bodies
