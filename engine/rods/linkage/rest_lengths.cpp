#include "engine/rods/linkage/rest_lengths.h"

#include "engine/rods/linkage/rest_length_map.h"

namespace limber::rods {
double RestLengths::edge(const LinkageGraph& graph, const ReducedVariables& variables, int segment,
                         int edge) const {
  const Segment& value = graph.segments[segment];
  if (edge == 0 && value.joints[kStart] >= 0)
    return terminal(value.rods[kStart], value.joints[kStart]);
  if (edge == variables.edges(segment) - 1 && value.joints[kFinish] >= 0)
    return terminal(value.rods[kFinish], value.joints[kFinish]);
  if (apart.empty()) return free_edge[segment];
  return apart[static_cast<std::size_t>(segment)][edge - (value.joints[kStart] >= 0 ? 1 : 0)];
}

RestLengths distribute_rest_lengths(const LinkageGraph& graph, const ReducedVariables& variables,
                                    const Eigen::Ref<const Eigen::VectorXd>& lengths) {
  return RestLengthMap(graph, variables, lengths).apply(lengths);
}

Eigen::VectorXd drawn_lengths(const LinkageGraph& graph) {
  Eigen::VectorXd lengths(static_cast<Eigen::Index>(graph.segments.size()));
  for (std::size_t s = 0; s < graph.segments.size(); ++s)
    lengths[static_cast<Eigen::Index>(s)] = graph.segments[s].length;
  return lengths;
}

}  // namespace limber::rods
