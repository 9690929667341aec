#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/scene/linkage.h"

namespace limber::session {

/// How far joints of a linkage can be from each other: along its rods.
class PinReach {
 public:
  explicit PinReach(const rods::LinkageGraph& graph);

  /// Pins with positions that are farther apart than the rods between them are long (and a tenth
  /// more, which rods might stretch by) contradict each other.
  /// @param target_lengths  rest lengths of segments; empty: as drawn
  /// @returns issues with field pins[i].position
  [[nodiscard]] std::vector<scene::Issue> check(const scene::LinkageConditions& conditions,
                                                const Eigen::VectorXd& target_lengths) const;
  /// The same of pins without positions too.
  /// @param places  3 x joints, where those hold their joints
  [[nodiscard]] std::vector<scene::Issue> check(const scene::LinkageConditions& conditions,
                                                const Eigen::VectorXd& target_lengths,
                                                const Eigen::Matrix3Xd& places) const;

 private:
  struct Link {
    int joint;
    int segment;
  };
  [[nodiscard]] std::vector<double> path_lengths_from(int joint,
                                                      const Eigen::VectorXd& lengths) const;

  std::vector<std::vector<Link>> links_;  // of each joint, to its neighbours
  Eigen::VectorXd drawn_;                 // lengths of segments
};

}  // namespace limber::session
