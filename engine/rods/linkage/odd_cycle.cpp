#include "engine/rods/linkage/odd_cycle.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>

namespace limber::rods::detail {
namespace {

/// Breadth first over pairs of a node and the parity of the walk to it.
class OddWalks {
 public:
  OddWalks(int nodes, const std::vector<ParityLink>& links)
      : next_(2 * static_cast<std::size_t>(nodes)) {
    for (const ParityLink& link : links) {
      const auto [a, b] = link.nodes;
      for (const int parity : {0, 1}) {
        next_[2 * a + parity].push_back(2 * b + (parity ^ link.parity));
        next_[2 * b + parity].push_back(2 * a + (parity ^ link.parity));
      }
    }
  }

  /// The nodes of a shortest odd walk from a node back to itself of fewer than `limit` links.
  std::vector<int> from(int node, std::size_t limit) {
    const int start = 2 * node, goal = start + 1;
    before_.assign(next_.size(), -1);
    std::vector<int> reached = {start};
    before_[start] = start;
    std::size_t layer_end = 1, links = 0;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      if (i == layer_end) {
        layer_end = reached.size();
        ++links;
      }
      if (links + 1 >= limit) break;
      for (const int next : next_[reached[i]]) {
        if (before_[next] >= 0) continue;
        before_[next] = reached[i];
        if (next == goal) return nodes_back_from(goal, start);
        reached.push_back(next);
      }
    }
    return {};
  }

 private:
  [[nodiscard]] std::vector<int> nodes_back_from(int at, int start) const {
    std::vector<int> walk;
    while (at != start) {
      at = before_[at];
      walk.push_back(at / 2);
    }
    std::reverse(walk.begin(), walk.end());
    return walk;
  }

  std::vector<std::vector<int>> next_;
  std::vector<int> before_;
};

}  // namespace

std::vector<int> shortest_odd_cycle(int nodes, const std::vector<ParityLink>& links) {
  OddWalks walks(nodes, links);
  std::vector<int> shortest;
  for (int node = 0; node < nodes; ++node) {
    const std::size_t limit =
        shortest.empty() ? 2 * static_cast<std::size_t>(nodes) + 1 : shortest.size();
    std::vector<int> walk = walks.from(node, limit);
    if (!walk.empty()) shortest = std::move(walk);
  }
  return shortest;
}

std::string loop_text(const std::vector<int>& vertices) {
  constexpr std::size_t kMaxNamed = 12;
  const std::size_t count = std::min(vertices.size(), kMaxNamed);
  const auto end = vertices.begin() + static_cast<std::ptrdiff_t>(count);
  std::string text = fmt::format("the {} joints at vertices {}", vertices.size(),
                                 fmt::join(vertices.begin(), end, ", "));
  if (vertices.size() > count) text += fmt::format(" and {} more", vertices.size() - count);
  return text + " (from 0)";
}

}  // namespace limber::rods::detail
