#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// Edges that the rest length of a segment affects: its own, and those of the segments that
/// continue its rod. They share a terminal edge with it and divide the length that this leaves
/// them.
struct LengthPattern {
  struct Reach {
    std::vector<int> segments;  // whose edges get another rest length, sorted
    std::vector<int> joints;    // at their ends, sorted
    std::vector<int> lengths;   // segments that have an edge in common with these, sorted
  };
  std::vector<Reach> reaches;  // of each segment
  /// Segments by colour: the joints and lengths of one colour are all different, so that a product
  /// with the sum of their directions has each one's rows for itself.
  std::vector<std::vector<int>> colours;
};

[[nodiscard]] LengthPattern length_pattern(const LinkageGraph& graph);

}  // namespace limber::rods
