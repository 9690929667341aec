#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/linkage/rest_length_map.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkage/pin_reach.h"

namespace limber::session {

/// What conditions must obey that more is needed for than their numbers: how far pins are apart,
/// and what rest lengths leave of segments between their joints.
class ConditionRules {
 public:
  /// @throws Error as rods::ReducedVariables
  ConditionRules(rods::LinkageGraph graph, int edges_per_segment);

  /// @pre scene::validate has nothing to say
  /// @returns issues with fields pins[i].position, segment_lengths[s]
  [[nodiscard]] std::vector<scene::Issue> check(const scene::LinkageConditions& conditions) const;

 private:
  rods::LinkageGraph graph_;
  rods::ReducedVariables variables_;
  Eigen::VectorXd drawn_;
  rods::RestLengthMap lengths_;
  PinReach reach_;
};

}  // namespace limber::session
