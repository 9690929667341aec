#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// The segments that one rod is made of.
struct RodChain {
  std::vector<int> segments;   // in order along the rod
  std::vector<char> reversed;  // of each: it runs from its finish to its start
  bool is_closed = false;      // a ring: the last segment goes on in the first
};

/// All rods of a linkage, in the order of their smallest segments. A ring begins with that and runs
/// along it; another rod begins at the end with the smaller segment.
[[nodiscard]] std::vector<RodChain> rod_chains(const LinkageGraph& graph);

}  // namespace limber::rods
