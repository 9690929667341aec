#include "engine/rods/linkage/alternating_letters.h"

#include <algorithm>
#include <map>
#include <utility>

namespace limber::rods::detail {
namespace {

/// A part whose free ends and joints of three segments are connected to one more node, so that an
/// even number of edges meets at each.
class ClosedWalk {
 public:
  ClosedWalk(const std::vector<JointChoices>& joints, const std::vector<int>& members)
      : incident_(members.size() + 1), used_count_(members.size() + 1, 0) {
    const int outside = static_cast<int>(members.size());
    std::map<int, std::vector<int>> ends;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const std::vector<int>& segments = joints[members[m]].segments;
      for (const int segment : segments) ends[segment].push_back(static_cast<int>(m));
      if (segments.size() % 2 == 1) add(-1, static_cast<int>(m), outside);
    }
    for (const auto& [segment, nodes] : ends)
      add(segment, nodes.front(), nodes.size() == 2 ? nodes.back() : outside);
    start_ = incident_.back().empty() ? 0 : outside;
  }

  /// Segments in the order of the walk (Hierholzer), -1 for edges that are none.
  std::vector<int> segments() {
    std::vector<std::pair<int, int>> path = {{start_, -1}};  // node, and the edge that led there
    std::vector<int> walk;
    while (!path.empty()) {
      const int node = path.back().first;
      std::size_t& next = used_count_[node];
      while (next < incident_[node].size() && edges_[incident_[node][next]].used) ++next;
      if (next < incident_[node].size()) {
        Edge& edge = edges_[incident_[node][next]];
        edge.used = true;
        path.emplace_back(edge.nodes[0] == node ? edge.nodes[1] : edge.nodes[0],
                          incident_[node][next]);
      } else {
        if (path.back().second >= 0) walk.push_back(edges_[path.back().second].segment);
        path.pop_back();
      }
    }
    return walk;
  }

 private:
  struct Edge {
    int segment;
    std::array<int, 2> nodes;
    bool used = false;
  };
  void add(int segment, int a, int b) {
    const int edge = static_cast<int>(edges_.size());
    edges_.push_back({segment, {a, b}});
    incident_[a].push_back(edge);
    incident_[b].push_back(edge);
  }

  std::vector<Edge> edges_;
  std::vector<std::vector<int>> incident_;  // edges of nodes
  std::vector<std::size_t> used_count_;
  int start_ = 0;
};

}  // namespace

void alternate_letters(const std::vector<JointChoices>& joints, const std::vector<int>& members,
                       SegmentLetters& letters) {
  signed char letter = 0;
  for (const int segment : ClosedWalk(joints, members).segments()) {
    if (segment >= 0) letters[segment] = letter;
    letter = static_cast<signed char>(1 - letter);
  }
}

}  // namespace limber::rods::detail
