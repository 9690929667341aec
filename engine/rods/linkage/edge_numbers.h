#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/linkage/rest_lengths.h"

namespace limber::rods {

/// Numbers of a linkage's edges if each has a rest length of its own. The free edges of all
/// segments come first, from start to finish. Then each joint has its terminal edge of rod A and
/// that of rod B, if present. A terminal edge is one number although two segments share it: both
/// see the same length.
class EdgeNumbers {
 public:
  EdgeNumbers(const LinkageGraph& graph, const ReducedVariables& variables);

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] int segments() const { return static_cast<int>(segments_.size()); }
  [[nodiscard]] int first_free(int segment) const { return segments_[segment].first; }
  [[nodiscard]] int free_edges(int segment) const { return segments_[segment].free_edges; }
  /// -1: the joint has no such rod.
  [[nodiscard]] int terminal(int joint, RodOfJoint rod) const { return terminals_[joint][rod]; }
  /// Number of edge i of a segment.
  [[nodiscard]] int edge(int segment, int edge) const;

  /// One number for each edge, and back: the length of a rod that is not there is infinite.
  [[nodiscard]] Eigen::VectorXd listed(const RestLengths& rest) const;
  [[nodiscard]] RestLengths distributed(const Eigen::Ref<const Eigen::VectorXd>& edges) const;
  /// From graph vertex to graph vertex: all of a segment's free edges and half of its terminal
  /// ones.
  [[nodiscard]] Eigen::VectorXd segment_lengths(
      const Eigen::Ref<const Eigen::VectorXd>& edges) const;

 private:
  struct Edges {
    int first;  // of the free ones
    int free_edges;
    std::array<int, 2> terminals;  // at the ends; -1: a free end
  };
  std::vector<Edges> segments_;
  std::vector<std::array<int, 2>> terminals_;  // by joint and rod
  int size_ = 0;
};

}  // namespace limber::rods
