#include "engine/rods/linkage/reduced_variables.h"

#include <fmt/format.h>

#include <cstdint>
#include <limits>

#include "engine/base/error.h"

namespace limber::rods {

ReducedVariables::ReducedVariables(const LinkageGraph& graph, std::vector<int> edges_per_segment)
    : edges_(std::move(edges_per_segment)), joints_(static_cast<int>(graph.joints.size())) {
  if (edges_.size() != graph.segments.size()) {
    throw Error(
        ErrorCode::kInvalidArgument, "edges_per_segment",
        fmt::format("{} numbers of edges for {} segments", edges_.size(), graph.segments.size()));
  }
  chains_.push_back(0);
  // Numbers of all unknowns, and of a chain before its terminal edges are left out.
  std::int64_t unknowns = std::int64_t{kJointUnknowns} * joints_;
  for (std::size_t s = 0; s < edges_.size(); ++s) {
    const std::array<int, 2>& joints = graph.segments[s].joints;
    const int ends = (joints[kStart] >= 0 ? 1 : 0) + (joints[kFinish] >= 0 ? 1 : 0);
    if (edges_[s] < 1 + ends) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("edges_per_segment[{}]", s),
                  fmt::format("segment {} with {} joints needs at least {} edges, it has {}", s,
                              ends, 1 + ends, edges_[s]));
    }
    unknowns += 4 * std::int64_t{edges_[s]} + 3;
    if (unknowns > std::numeric_limits<int>::max()) {
      throw Error(ErrorCode::kLimitExceeded, fmt::format("edges_per_segment[{}]", s),
                  fmt::format("the linkage has more than {} unknowns up to segment {} of {} edges",
                              std::numeric_limits<int>::max(), s, edges_[s]));
    }
    skipped_.push_back(joints[kStart] >= 0 ? 7 : 0);
    chains_.push_back(chains_.back() + 4 * edges_[s] + 3 - 7 * ends);
  }
  joints_begin_ = chains_.back();
}

ReducedVariables::ReducedVariables(const LinkageGraph& graph, int edges_per_segment)
    : ReducedVariables(graph, std::vector<int>(graph.segments.size(), edges_per_segment)) {}

}  // namespace limber::rods
