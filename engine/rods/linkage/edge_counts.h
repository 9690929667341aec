#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// How many edges each segment is cut into: as many as asked, but for segments shorter than a tenth
/// of the median one. Those take fewer, so that their edges are not shorter than a tenth of the
/// typical edge, and at least what their ends demand (ReducedVariables). The edges of a segment
/// that short resolve no bending of it, while bending stiffness grows with the cube of their
/// number. Rounding of places then hides small loads elsewhere.
/// @param edges  of a segment of median length
[[nodiscard]] std::vector<int> edges_by_length(const LinkageGraph& graph, int edges);

}  // namespace limber::rods
