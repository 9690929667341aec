#include "engine/rods/linkage/length_pattern.h"

#include <algorithm>
#include <array>

namespace limber::rods {
namespace {

void sort_unique(std::vector<int>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// A segment and those that continue its rod at its joints.
std::vector<std::vector<int>> find_neighbours(const LinkageGraph& graph) {
  std::vector<std::array<std::vector<int>, 2>> at(graph.joints.size());
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = graph.segments[s];
    for (const End end : {kStart, kFinish})
      if (segment.joints[end] >= 0)
        at[segment.joints[end]][segment.rods[end]].push_back(static_cast<int>(s));
  }
  std::vector<std::vector<int>> neighbours;
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const Segment& segment = graph.segments[s];
    std::vector<int> list{static_cast<int>(s)};
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] < 0) continue;
      const auto& others = at[segment.joints[end]][segment.rods[end]];
      list.insert(list.end(), others.begin(), others.end());
    }
    sort_unique(list);
    neighbours.push_back(std::move(list));
  }
  return neighbours;
}

/// Colours that something has been given to.
class Taken {
 public:
  [[nodiscard]] bool has(std::size_t colour) const {
    return colour < colours_.size() && colours_[colour];
  }
  void add(std::size_t colour) {
    if (colours_.size() <= colour) colours_.resize(colour + 1, false);
    colours_[colour] = true;
  }

 private:
  std::vector<bool> colours_;
};

void colour(const LinkageGraph& graph, LengthPattern& pattern) {
  std::vector<Taken> by_joint(graph.joints.size()), by_length(graph.segments.size());
  for (std::size_t s = 0; s < pattern.reaches.size(); ++s) {
    const LengthPattern::Reach& reach = pattern.reaches[s];
    const auto is_free = [&](std::size_t colour) {
      const auto takes = [&](const std::vector<Taken>& taken) {
        return [&taken, colour](int index) { return taken[index].has(colour); };
      };
      return std::none_of(reach.joints.begin(), reach.joints.end(), takes(by_joint)) &&
             std::none_of(reach.lengths.begin(), reach.lengths.end(), takes(by_length));
    };
    std::size_t own = 0;
    while (!is_free(own)) ++own;
    for (const int joint : reach.joints) by_joint[joint].add(own);
    for (const int length : reach.lengths) by_length[length].add(own);
    if (pattern.colours.size() <= own) pattern.colours.resize(own + 1);
    pattern.colours[own].push_back(static_cast<int>(s));
  }
}

}  // namespace

LengthPattern length_pattern(const LinkageGraph& graph) {
  const std::vector<std::vector<int>> neighbours = find_neighbours(graph);
  LengthPattern pattern;
  for (const std::vector<int>& own : neighbours) {
    LengthPattern::Reach reach{own, {}, {}};
    for (const int s : own) {
      for (const int joint : graph.segments[s].joints)
        if (joint >= 0) reach.joints.push_back(joint);
      reach.lengths.insert(reach.lengths.end(), neighbours[s].begin(), neighbours[s].end());
    }
    sort_unique(reach.joints);
    sort_unique(reach.lengths);
    pattern.reaches.push_back(std::move(reach));
  }
  colour(graph, pattern);
  return pattern;
}

}  // namespace limber::rods
