#include "engine/session/linkages/pin_reach.h"

#include <fmt/format.h>

#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace limber::session {
namespace {

constexpr double kStretched = 1.1;

}  // namespace

PinReach::PinReach(const rods::LinkageGraph& graph)
    : links_(graph.joints.size()), drawn_(static_cast<Eigen::Index>(graph.segments.size())) {
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    const rods::Segment& segment = graph.segments[s];
    drawn_[static_cast<Eigen::Index>(s)] = segment.length;
    const auto& joints = segment.joints;
    if (joints[0] < 0 || joints[1] < 0) continue;
    links_[static_cast<std::size_t>(joints[0])].push_back({joints[1], static_cast<int>(s)});
    links_[static_cast<std::size_t>(joints[1])].push_back({joints[0], static_cast<int>(s)});
  }
}

/// Shortest paths along the rods (Dijkstra 1959); infinite to other components.
std::vector<double> PinReach::path_lengths_from(int joint, const Eigen::VectorXd& lengths) const {
  std::vector<double> length(links_.size(), std::numeric_limits<double>::infinity());
  using Place = std::pair<double, int>;
  std::priority_queue<Place, std::vector<Place>, std::greater<>> places;
  length[static_cast<std::size_t>(joint)] = 0;
  places.emplace(0, joint);
  while (!places.empty()) {
    const auto [so_far, at] = places.top();
    places.pop();
    if (so_far > length[static_cast<std::size_t>(at)]) continue;
    for (const Link& link : links_[static_cast<std::size_t>(at)]) {
      const double there = so_far + lengths[link.segment];
      if (there >= length[static_cast<std::size_t>(link.joint)]) continue;
      length[static_cast<std::size_t>(link.joint)] = there;
      places.emplace(there, link.joint);
    }
  }
  return length;
}

std::vector<scene::Issue> PinReach::check(const scene::LinkageConditions& conditions,
                                          const Eigen::VectorXd& target_lengths) const {
  std::vector<scene::Issue> issues;
  const auto& pins = conditions.pins;
  const Eigen::VectorXd& lengths = target_lengths.size() == 0 ? drawn_ : target_lengths;
  for (std::size_t i = 0; i < pins.size(); ++i) {
    if (!pins[i].position) continue;
    std::vector<double> path_lengths;
    for (std::size_t k = 0; k < i; ++k) {
      if (!pins[k].position) continue;
      if (path_lengths.empty()) path_lengths = path_lengths_from(pins[i].joint, lengths);
      const double path_length = path_lengths[static_cast<std::size_t>(pins[k].joint)];
      const double distance = (*pins[i].position - *pins[k].position).norm();
      if (distance <= kStretched * path_length) continue;
      issues.push_back({scene::Issue::Severity::kError, fmt::format("pins[{}].position", i),
                        fmt::format("joints {} and {} are pinned {:g} apart, and the rods between "
                                    "them are {:g} long",
                                    pins[k].joint, pins[i].joint, distance, path_length),
                        ErrorCode::kInvalidArgument});
      break;
    }
  }
  return issues;
}

std::vector<scene::Issue> PinReach::check(const scene::LinkageConditions& conditions,
                                          const Eigen::VectorXd& target_lengths,
                                          const Eigen::Matrix3Xd& places) const {
  scene::LinkageConditions placed;
  placed.pins = conditions.pins;
  for (scene::JointPin& pin : placed.pins)
    if (pin.held != scene::Held::kAngle && !pin.position) pin.position = places.col(pin.joint);
  return check(placed, target_lengths);
}

}  // namespace limber::session
