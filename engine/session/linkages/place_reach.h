#pragma once

#include <string>
#include <vector>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/scene/linkage.h"

namespace limber::session {

/// How far from a linkage targets and pins may be: numbers of 16 digits leave too few of them for
/// the rods where springs are far longer than these.
class PlaceReach {
 public:
  static constexpr double kFarthest = 1e6;  // [extents of the linkage]

  /// @param length_unit  of the graph [m], for messages
  PlaceReach(const rods::LinkageGraph& graph, double length_unit);

  /// @returns issues (kOutOfRange) with fields targets[i].position, pins[i].position
  [[nodiscard]] std::vector<scene::Issue> check(const scene::LinkageConditions& conditions) const;
  [[nodiscard]] bool is_far(const Eigen::Vector3d& position) const;

 private:
  [[nodiscard]] scene::Issue refusal(std::string field, const std::string& what,
                                     const Eigen::Vector3d& position) const;

  Eigen::Vector3d middle_;
  double reach_;
  std::string unit_;
};

}  // namespace limber::session
