#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"

namespace limber::rods {

/// Share of a terminal edge's stretching energy that each of its two segments carries. It stays a
/// half where only one segment continues: its other half stands beyond the joint.
inline constexpr double kTerminalDensity = 0.5;

/// Rest lengths of all edges. Each rod of each joint has one (the terminal edge that its segments
/// share). Free edges have one per segment, or one each.
struct RestLengths {
  Eigen::Matrix2Xd terminal;  // 2 x joints: rod A, rod B
  Eigen::VectorXd free_edge;  // segments; the mean where they differ
  /// For each segment: rest lengths of its free edges from start to finish; empty: all are equal.
  std::vector<Eigen::VectorXd> apart = {};

  /// Rest length of edge i of a segment.
  [[nodiscard]] double edge(const LinkageGraph& graph, const ReducedVariables& variables,
                            int segment, int edge) const;
};

/// A segment of length L reaches from joint to joint, and its terminal edges half their length
/// beyond. A terminal edge takes the shorter of the uniform lengths L / (n - ends / 2) of its two
/// segments; the free edges share the rest of L.
/// @param lengths  rest length of each segment, from graph vertex to graph vertex
/// @throws Error{kInvalidArgument} with field lengths[s] for one that is not positive and finite
[[nodiscard]] RestLengths distribute_rest_lengths(const LinkageGraph& graph,
                                                  const ReducedVariables& variables,
                                                  const Eigen::Ref<const Eigen::VectorXd>& lengths);

/// Rest lengths of segments as the input draws them: distances in the line mesh.
[[nodiscard]] Eigen::VectorXd drawn_lengths(const LinkageGraph& graph);

}  // namespace limber::rods
