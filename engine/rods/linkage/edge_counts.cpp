#include "engine/rods/linkage/edge_counts.h"

#include <algorithm>
#include <cmath>

namespace limber::rods {
namespace {

constexpr double kShort = 0.1;  // of the median length, and of the typical edge

double median_length(const LinkageGraph& graph) {
  std::vector<double> lengths;
  for (const Segment& segment : graph.segments) lengths.push_back(segment.length);
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

}  // namespace

std::vector<int> edges_by_length(const LinkageGraph& graph, int edges) {
  std::vector<int> counts(graph.segments.size(), edges);
  if (counts.empty()) return counts;
  const double short_length = kShort * median_length(graph);
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
