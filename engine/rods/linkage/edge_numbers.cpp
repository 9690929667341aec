#include "engine/rods/linkage/edge_numbers.h"

#include <limits>

#include "engine/base/error.h"

namespace limber::rods {

EdgeNumbers::EdgeNumbers(const LinkageGraph& graph, const ReducedVariables& variables)
    : terminals_(graph.joints.size(), {-1, -1}) {
  for (int s = 0; s < variables.segments(); ++s) {
    Edges edges{size_, variables.edges(s), {-1, -1}};
    for (const End end : {kStart, kFinish})
      if (graph.segments[s].joints[end] >= 0) --edges.free_edges;
    size_ += edges.free_edges;
    segments_.push_back(edges);
  }
  const auto each_end = [&](const auto& call) {
    for (int s = 0; s < variables.segments(); ++s) {
      const Segment& segment = graph.segments[s];
      for (const End end : {kStart, kFinish}) {
        if (segment.joints[end] >= 0)
          call(terminals_[segment.joints[end]][segment.rods[end]], segments_[s].terminals[end]);
      }
    }
  };
  each_end([](int& terminal, int&) { terminal = 0; });
  for (auto& rods : terminals_)
    for (int& terminal : rods)
      if (terminal == 0) terminal = size_++;
  each_end([](int terminal, int& of_segment) { of_segment = terminal; });
}

int EdgeNumbers::edge(int segment, int edge) const {
  const Edges& edges = segments_[segment];
  const int place = edge - (edges.terminals[kStart] >= 0 ? 1 : 0);
  if (place < 0) return edges.terminals[kStart];
  return place < edges.free_edges ? edges.first + place : edges.terminals[kFinish];
}

Eigen::VectorXd EdgeNumbers::listed(const RestLengths& rest) const {
  Eigen::VectorXd result(size());
  for (int s = 0; s < segments(); ++s) {
    auto own = result.segment(first_free(s), free_edges(s));
    if (rest.apart.empty()) {
      own.setConstant(rest.free_edge[s]);
    } else {
      own = rest.apart[static_cast<std::size_t>(s)];
    }
  }
  for (std::size_t j = 0; j < terminals_.size(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      if (terminals_[j][rod] >= 0)
        result[terminals_[j][rod]] = rest.terminal(rod, static_cast<Eigen::Index>(j));
    }
  }
  return result;
}

RestLengths EdgeNumbers::distributed(const Eigen::Ref<const Eigen::VectorXd>& edges) const {
  LIMBER_DEMAND(edges.size() == size());
  RestLengths rest{Eigen::Matrix2Xd(2, static_cast<Eigen::Index>(terminals_.size())),
                   Eigen::VectorXd(segments())};
  for (std::size_t j = 0; j < terminals_.size(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      rest.terminal(rod, static_cast<Eigen::Index>(j)) =
          terminals_[j][rod] >= 0 ? edges[terminals_[j][rod]]
                                  : std::numeric_limits<double>::infinity();
    }
  }
  for (int s = 0; s < segments(); ++s) {
    rest.apart.emplace_back(edges.segment(first_free(s), free_edges(s)));
    rest.free_edge[s] = rest.apart.back().mean();
  }
  return rest;
}

Eigen::VectorXd EdgeNumbers::segment_lengths(const Eigen::Ref<const Eigen::VectorXd>& edges) const {
  LIMBER_DEMAND(edges.size() == size());
  Eigen::VectorXd result(segments());
  for (int s = 0; s < segments(); ++s) {
    result[s] = edges.segment(first_free(s), free_edges(s)).sum();
    for (const int terminal : segments_[s].terminals)
      if (terminal >= 0) result[s] += edges[terminal] / 2;
  }
  return result;
}

}  // namespace limber::rods
