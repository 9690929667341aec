#include "engine/rods/linkage/odd_cycle.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "engine/rods/linkage/parity_forest.h"

namespace limber::rods::detail {
namespace {

/// Breadth first over pairs of a node and the parity of the walk to it.
class OddWalks {
 public:
  OddWalks(int nodes, const std::vector<ParityLink>& links)
      : next_(2 * static_cast<std::size_t>(nodes)), before_(next_.size(), -1) {
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
    for (const int state : reached_) before_[state] = -1;
    reached_ = {start};
    before_[start] = start;
    std::size_t layer_end = 1, links = 0;
    for (std::size_t i = 0; i < reached_.size(); ++i) {
      if (i == layer_end) {
        layer_end = reached_.size();
        ++links;
      }
      if (links + 1 >= limit) break;
      ++visited_count_;
      for (const int next : next_[reached_[i]]) {
        if (before_[next] >= 0) continue;
        before_[next] = reached_[i];
        reached_.push_back(next);
        if (next == goal) return nodes_back_from(goal, start);
      }
    }
    return {};
  }

  /// States passed in all walks.
  [[nodiscard]] std::size_t visited_count() const { return visited_count_; }

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
  std::vector<int> before_;   // -1 but for those reached last
  std::vector<int> reached_;  // in the last walk
  std::size_t visited_count_ = 0;
};

constexpr std::size_t kMaxVisited = 20'000'000;  // states of all walks: about a second

/// The nodes of links that contradict those before them, ascending: every odd cycle has one of
/// these links.
std::vector<int> ends_of_contradictions(int nodes, const std::vector<ParityLink>& links) {
  ParityForest forest(static_cast<std::size_t>(nodes));
  std::vector<int> ends;
  for (const ParityLink& link : links)
    if (!forest.join(link.nodes[0], link.nodes[1], link.parity))
      ends.insert(ends.end(), link.nodes.begin(), link.nodes.end());
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

/// All nodes at most so many links away from some, ascending.
std::vector<int> nodes_near(std::vector<int> near, std::size_t most_links, int nodes,
                            const std::vector<ParityLink>& links) {
  std::vector<std::vector<int>> next(static_cast<std::size_t>(nodes));
  for (const ParityLink& link : links) {
    next[link.nodes[0]].push_back(link.nodes[1]);
    next[link.nodes[1]].push_back(link.nodes[0]);
  }
  std::vector<char> is_near(next.size(), 0);
  for (const int node : near) is_near[node] = 1;
  std::size_t begin = 0;
  for (std::size_t away = 0; away < most_links; ++away) {
    const std::size_t end = near.size();
    for (; begin < end; ++begin)
      for (const int node : next[near[begin]])
        if (!std::exchange(is_near[node], 1)) near.push_back(node);
  }
  std::sort(near.begin(), near.end());
  return near;
}

}  // namespace

std::vector<int> shortest_odd_cycle(int nodes, const std::vector<ParityLink>& links) {
  const std::vector<int> ends = ends_of_contradictions(nodes, links);
  if (ends.empty()) return {};
  OddWalks walks(nodes, links);
  std::vector<int> shortest = walks.from(ends.front(), 2 * static_cast<std::size_t>(nodes) + 1);
  // That walk leads to a cycle: from there much shorter ones are found, which bound all others.
  for (std::size_t i = 0; i < shortest.size();) {
    std::vector<int> walk = walks.from(shortest[i++], shortest.size());
    if (walk.empty()) continue;
    shortest = std::move(walk);
    i = 0;
  }
  for (const int node : ends) {
    if (walks.visited_count() >= kMaxVisited) break;
    std::vector<int> walk = walks.from(node, shortest.size());
    if (!walk.empty()) shortest = std::move(walk);
  }
  for (const int node : nodes_near(ends, shortest.size() / 2, nodes, links)) {
    if (walks.visited_count() >= kMaxVisited) break;
    std::vector<int> walk = walks.from(node, shortest.size() + 1);
    if (!walk.empty()) return walk;
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
