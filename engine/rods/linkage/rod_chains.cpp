#include "engine/rods/linkage/rod_chains.h"

#include <algorithm>
#include <cstddef>

namespace limber::rods {
namespace {

/// A segment and the end at which it is entered.
struct Step {
  int segment;
  End entered;
};

/// Continuation of a rod after a segment; segment -1: none.
Step after(const LinkageGraph& graph, const Step& step) {
  const Segment& segment = graph.segments[static_cast<std::size_t>(step.segment)];
  const End left = step.entered == kStart ? kFinish : kStart;
  const int joint = segment.joints[left];
  if (joint < 0) return {-1, kStart};
  const RodOfJoint rod = segment.rods[left];
  const std::array<int, 2>& pair = graph.joints[static_cast<std::size_t>(joint)].segments[rod];
  const int next = pair[0] == step.segment ? pair[1] : pair[0];
  if (next < 0) return {-1, kStart};
  const Segment& other = graph.segments[static_cast<std::size_t>(next)];
  return {next, other.joints[kStart] == joint ? kStart : kFinish};
}

/// From a step to the rod's end, or once around it.
std::vector<Step> walk(const LinkageGraph& graph, const Step& first, bool& is_closed) {
  std::vector<Step> steps = {first};
  for (;;) {
    const Step next = after(graph, steps.back());
    is_closed = next.segment == first.segment;
    if (next.segment < 0 || is_closed) return steps;
    steps.push_back(next);
  }
}

}  // namespace

std::vector<RodChain> rod_chains(const LinkageGraph& graph) {
  std::vector<RodChain> chains;
  std::vector<char> placed(graph.segments.size(), 0);
  for (int s = 0; s < static_cast<int>(graph.segments.size()); ++s) {
    if (placed[static_cast<std::size_t>(s)] != 0) continue;
    RodChain chain;
    std::vector<Step> steps = walk(graph, {s, kStart}, chain.is_closed);
    if (!chain.is_closed) {
      const Step last = steps.back();
      steps =
          walk(graph, {last.segment, last.entered == kStart ? kFinish : kStart}, chain.is_closed);
      if (steps.size() > 1 ? steps.back().segment < steps.front().segment
                           : steps.front().entered == kFinish) {
        std::reverse(steps.begin(), steps.end());
        for (Step& step : steps) step.entered = step.entered == kStart ? kFinish : kStart;
      }
    }
    for (const Step& step : steps) {
      placed[static_cast<std::size_t>(step.segment)] = 1;
      chain.segments.push_back(step.segment);
      chain.reversed.push_back(step.entered == kFinish ? 1 : 0);
    }
    chains.push_back(std::move(chain));
  }
  return chains;
}

}  // namespace limber::rods
