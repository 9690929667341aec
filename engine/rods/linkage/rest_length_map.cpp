#include "engine/rods/linkage/rest_length_map.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

void check_length(int segment, double length) {
  if (length > 0 && std::isfinite(length)) return;
  throw Error(
      ErrorCode::kInvalidArgument, fmt::format("lengths[{}]", segment),
      fmt::format("the rest length of segment {} is {}; it must be positive", segment, length));
}

}  // namespace

RestLengthMap::RestLengthMap(const LinkageGraph& graph, const ReducedVariables& variables,
                             const Eigen::Ref<const Eigen::VectorXd>& lengths)
    : givers_(graph.joints.size(), {-1, -1}) {
  LIMBER_DEMAND(lengths.size() == variables.segments());
  std::vector<std::array<double, 2>> least(graph.joints.size());
  for (auto& pair : least) pair.fill(std::numeric_limits<double>::infinity());
  for (int s = 0; s < variables.segments(); ++s) {
    check_length(s, lengths[s]);
    const Segment& segment = graph.segments[s];
    Shares shares{{}, double(variables.edges(s)), variables.edges(s)};
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] < 0) continue;
      shares.ends[end] = {segment.joints[end], segment.rods[end]};
      shares.uniform -= 0.5;
      --shares.free_edges;
    }
    for (const Terminal& end : shares.ends) {
      if (end.joint < 0 || !(lengths[s] / shares.uniform < least[end.joint][end.rod])) continue;
      least[end.joint][end.rod] = lengths[s] / shares.uniform;
      givers_[end.joint][end.rod] = s;
    }
    segments_.push_back(shares);
  }
}

RestLengths RestLengthMap::apply_to_change(const Eigen::Ref<const Eigen::VectorXd>& change) const {
  LIMBER_DEMAND(change.size() == segments());
  RestLengths rest;
  rest.terminal.setConstant(2, static_cast<Eigen::Index>(givers_.size()),
                            std::numeric_limits<double>::infinity());
  rest.free_edge.resize(segments());
  for (std::size_t j = 0; j < givers_.size(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const int giver = givers_[j][rod];
      if (giver >= 0)
        rest.terminal(rod, static_cast<Eigen::Index>(j)) = change[giver] / segments_[giver].uniform;
    }
  }
  for (int s = 0; s < segments(); ++s) {
    double left = change[s];
    for (const Terminal& end : segments_[s].ends)
      if (end.joint >= 0) left -= rest.terminal(end.rod, end.joint) / 2;
    rest.free_edge[s] = left / segments_[s].free_edges;
  }
  return rest;
}

RestLengths RestLengthMap::apply(const Eigen::Ref<const Eigen::VectorXd>& lengths) const {
  for (int s = 0; s < segments(); ++s) check_length(s, lengths[s]);
  RestLengths rest = apply_to_change(lengths);
  for (int s = 0; s < segments(); ++s) {
    if (rest.free_edge[s] > 0) continue;
    throw Error(
        ErrorCode::kInvalidArgument, fmt::format("lengths[{}]", s),
        fmt::format("the rest length {} of segment {} is used up by the edges at its joints",
                    lengths[s], s));
  }
  return rest;
}

Eigen::VectorXd RestLengthMap::transposed(const RestLengths& derivatives) const {
  Eigen::VectorXd result(segments());
  Eigen::Matrix2Xd terminal = derivatives.terminal;
  for (int s = 0; s < segments(); ++s) {
    result[s] = derivatives.free_edge[s] / segments_[s].free_edges;
    for (const Terminal& end : segments_[s].ends)
      if (end.joint >= 0) terminal(end.rod, end.joint) -= result[s] / 2;
  }
  for (std::size_t j = 0; j < givers_.size(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const int giver = givers_[j][rod];
      if (giver >= 0)
        result[giver] += terminal(rod, static_cast<Eigen::Index>(j)) / segments_[giver].uniform;
    }
  }
  return result;
}

}  // namespace limber::rods
