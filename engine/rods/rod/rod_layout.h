#pragma once

#include <vector>

#include "engine/rods/rod/slot_array.h"

namespace limber::rods {

/// Several rods end to end, so that one sweep serves them all (the segments of a linkage, or one
/// rod). Node i of rod r has the slot first_node(r) + i; an edge has the slot of the node at its
/// start, an interior vertex that of its node. The last node of a rod starts no edge: that slot's
/// edge is inactive.
///
///   rod 0, 3 edges        rod 1, 2 edges
///   slot  0   1   2   3   4   5   6
///   node  o   o   o   o   o   o   o
///   edge   ---  ---  ---   (none)  ---  ---   (none)
///
/// Unknowns are 4 per slot: 4 * slot + axis is the position of the node, 4 * slot + 3 the angle
/// theta of the edge. Without an edge that angle has no meaning: gradients are zero.
class RodLayout {
 public:
  /// @param edges_of_rod  number of edges of every rod, each >= 1
  /// @throws Error{kInvalidArgument} naming the rod
  explicit RodLayout(const std::vector<int>& edges_of_rod);

  [[nodiscard]] int rods() const { return static_cast<int>(first_.size()) - 1; }
  [[nodiscard]] int nodes() const { return first_.back(); }
  [[nodiscard]] int unknowns() const { return 4 * nodes(); }
  [[nodiscard]] int first_node(int rod) const { return first_[static_cast<std::size_t>(rod)]; }
  [[nodiscard]] int edges(int rod) const { return first_node(rod + 1) - first_node(rod) - 1; }
  [[nodiscard]] bool is_edge(int slot) const { return activity_(slot, 0) > 0.5; }
  [[nodiscard]] bool is_interior(int slot) const { return activity_(slot, 1) > 0.5; }

  /// Rows of a slot array: the nodes, and spare ones for whole registers.
  [[nodiscard]] Eigen::Index rows() const { return activity_.rows(); }
  /// Column 0: 1 where the slot has an edge; column 1: 1 where it is an interior vertex.
  [[nodiscard]] const SlotArray& activity() const { return activity_; }

 private:
  std::vector<int> first_;
  SlotArray activity_;
};

}  // namespace limber::rods
