#pragma once

#include <optional>
#include <vector>

#include "engine/rods/linkage/edge_numbers.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/linkage/rest_length_map.h"
#include "engine/rods/linkage/state_check.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkage/pin_reach.h"
#include "engine/session/linkage/place_reach.h"

namespace limber::session {

/// What conditions must obey that more is needed for than their numbers: how far away targets and
/// pins are, how far pins are apart, what rest lengths leave of segments between their joints, and
/// how many edges there are.
class ConditionRules {
 public:
  /// @param length_unit  of the graph [m], for messages
  /// @throws Error as rods::ReducedVariables
  ConditionRules(rods::LinkageGraph graph, int edges_per_segment, double length_unit);

  /// @pre scene::validate has nothing to say
  /// @returns issues with fields targets[i].position, pins[i].position, segment_lengths[s],
  /// edge_lengths, edge_lengths[e], section_scales[s]
  [[nodiscard]] std::vector<scene::Issue> check(const scene::LinkageConditions& conditions) const;
  /// The same of a linkage that is just opened: pins without positions hold joints where they are.
  /// @param places  3 x joints [length unit of the graph]; nothing: where they are drawn
  [[nodiscard]] std::vector<scene::Issue> check_opened(
      const scene::LinkageConditions& conditions,
      const std::optional<Eigen::Matrix3Xd>& places) const;
  /// @throws Error as rods::validate(StateNumbers)
  void check_shape(const rods::StateNumbers& shape) const {
    rods::validate(shape, graph_, variables_);
  }

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
