#include "engine/rods/linkage/edge_counts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/numerics/median.h"

namespace limber::rods {
namespace {

constexpr double kShort = 0.1;  // of the median length, and of the typical edge

}  // namespace

std::vector<int> edges_by_length(const LinkageGraph& graph, int edges) {
  std::vector<int> counts(graph.segments.size(), edges);
  if (counts.empty()) return counts;
  std::vector<double> lengths;
  for (const Segment& segment : graph.segments) lengths.push_back(segment.length);
  const double short_length = kShort * median(std::move(lengths));
  for (std::size_t s = 0; s < counts.size(); ++s) {
    const Segment& segment = graph.segments[s];
    if (segment.length >= short_length) continue;
    const int ends = (segment.joints[kStart] >= 0 ? 1 : 0) + (segment.joints[kFinish] >= 0 ? 1 : 0);
    const int fine = static_cast<int>(std::floor(edges * segment.length / short_length));
    counts[s] = std::min(edges, std::max(1 + ends, fine));
  }
  return counts;
}

}  // namespace limber::rods
