#pragma once

#include <cstddef>
#include <vector>

#include "engine/rods/linkage/edge_numbers.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/linkage/rest_length_map.h"
#include "engine/rods/linkage/state_check.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/pin_reach.h"
#include "engine/session/linkages/place_reach.h"

namespace limber::session {

/// Rules on conditions that need more than their numbers: how far away targets and pins are, how
/// far pins are apart, how much of a segment its rest lengths leave between joints, and the number
/// of edges.
class ConditionRules {
 public:
  /// @param length_unit  of the graph [m], for messages
  /// @throws Error as rods::ReducedVariables
  ConditionRules(rods::LinkageGraph graph, int edges_per_segment, double length_unit);

  /// @pre scene::validate has nothing to say
  /// @returns issues with fields mean_angle, targets[i].position, pins[i].position,
  /// segment_lengths[s], edge_lengths, edge_lengths[e], section_scales[s]
  [[nodiscard]] std::vector<scene::Issue> check(const scene::LinkageConditions& conditions) const;
  /// The same of a linkage that is as drawn: pins without positions hold joints where they are
  /// drawn.
  [[nodiscard]] std::vector<scene::Issue> check_drawn(
      const scene::LinkageConditions& conditions) const;
  /// @throws Error as rods::validate(StateNumbers); {kOutOfRange, "positions"} for a shape that is
  /// as far away as no target may be
  void check_shape(const rods::StateNumbers& shape) const;
  /// Upper bound on the memory of one answer that undo returns to. It covers two shapes, since a
  /// failed answer keeps the last reached one. Each takes 56 bytes for each vertex of a segment,
  /// 104 for each joint, 8 for each rest length of segments and edges and each scale, and 1 KiB.
  [[nodiscard]] std::size_t answer_bytes() const;

 private:
  rods::LinkageGraph graph_;
  rods::ReducedVariables variables_;
  Eigen::VectorXd drawn_;
  rods::RestLengthMap lengths_;
  rods::EdgeNumbers edges_;
  Eigen::VectorXd drawn_edges_;
  PinReach reach_;
  PlaceReach places_;
};

}  // namespace limber::session
