#include "engine/rods/linkage/rest_lengths.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

int joint_ends(const Segment& segment) {
  return (segment.joints[kStart] >= 0 ? 1 : 0) + (segment.joints[kFinish] >= 0 ? 1 : 0);
}

}  // namespace

double RestLengths::edge(const LinkageGraph& graph, const ReducedVariables& variables, int segment,
                         int edge) const {
  const Segment& value = graph.segments[segment];
  if (edge == 0 && value.joints[kStart] >= 0)
    return terminal(value.rods[kStart], value.joints[kStart]);
  if (edge == variables.edges(segment) - 1 && value.joints[kFinish] >= 0)
    return terminal(value.rods[kFinish], value.joints[kFinish]);
  return free_edge[segment];
}

RestLengths distribute_rest_lengths(const LinkageGraph& graph, const ReducedVariables& variables,
                                    const Eigen::Ref<const Eigen::VectorXd>& lengths) {
  const int segments = variables.segments();
  LIMBER_DEMAND(lengths.size() == segments);
  RestLengths rest;
  rest.terminal.setConstant(2, variables.joints(), std::numeric_limits<double>::infinity());
  rest.free_edge.resize(segments);
  for (int s = 0; s < segments; ++s) {
    if (!(lengths[s] > 0) || !std::isfinite(lengths[s])) {
      throw Error(
          ErrorCode::kInvalidArgument, fmt::format("lengths[{}]", s),
          fmt::format("the rest length of segment {} is {}; it must be positive", s, lengths[s]));
    }
    const Segment& segment = graph.segments[s];
    const double uniform = lengths[s] / (variables.edges(s) - 0.5 * joint_ends(segment));
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] < 0) continue;
      double& shared = rest.terminal(segment.rods[end], segment.joints[end]);
      shared = std::min(shared, uniform);
    }
  }
  for (int s = 0; s < segments; ++s) {
    const Segment& segment = graph.segments[s];
    double left = lengths[s];
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] >= 0)
        left -= rest.terminal(segment.rods[end], segment.joints[end]) / 2;
    }
    rest.free_edge[s] = left / (variables.edges(s) - joint_ends(segment));
  }
  return rest;
}

Eigen::VectorXd drawn_lengths(const LinkageGraph& graph) {
  Eigen::VectorXd lengths(static_cast<Eigen::Index>(graph.segments.size()));
  for (std::size_t s = 0; s < graph.segments.size(); ++s)
    lengths[static_cast<Eigen::Index>(s)] = graph.segments[s].length;
  return lengths;
}

}  // namespace limber::rods
