#include "engine/session/linkages/place_reach.h"

#include <fmt/format.h>

#include <utility>

#include "engine/session/linkages/unit_name.h"

namespace limber::session {

PlaceReach::PlaceReach(const rods::LinkageGraph& graph, double length_unit)
    : unit_(unit_name(length_unit)) {
  Eigen::Vector3d low = graph.segments[0].points[0], high = low;
  for (const rods::Segment& segment : graph.segments) {
    for (const Eigen::Vector3d& point : segment.points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
  }
  middle_ = (low + high) / 2;
  reach_ = kFarthest * (high - low).maxCoeff();
}

bool PlaceReach::is_far(const Eigen::Vector3d& position) const {
  return (position - middle_).cwiseAbs().maxCoeff() > reach_;
}

scene::Issue PlaceReach::refusal(std::string field, const std::string& what,
                                 const Eigen::Vector3d& position) const {
  return {
      scene::Issue::Severity::kError, std::move(field),
      fmt::format("{} at ({:g}, {:g}, {:g}) {} is farther than {:.0e} lengths of the linkage, "
                  "{:g} {}, from its middle",
                  what, position.x(), position.y(), position.z(), unit_, kFarthest, reach_, unit_),
      ErrorCode::kOutOfRange};
}

std::vector<scene::Issue> PlaceReach::check(const scene::LinkageConditions& conditions) const {
  std::vector<scene::Issue> issues;
  for (std::size_t i = 0; i < conditions.targets.size(); ++i) {
    const scene::LinkageTarget& target = conditions.targets[i];
    if (!is_far(target.position)) continue;
    const std::string what =
        target.joint >= 0
            ? fmt::format("the target of joint {}", target.joint)
            : fmt::format("the target of segment {} (share {:g})", target.segment, target.share);
    issues.push_back(refusal(fmt::format("targets[{}].position", i), what, target.position));
  }
  for (std::size_t i = 0; i < conditions.pins.size(); ++i) {
    const scene::JointPin& pin = conditions.pins[i];
    if (!pin.position || !is_far(*pin.position)) continue;
    issues.push_back(refusal(fmt::format("pins[{}].position", i),
                             fmt::format("the pin of joint {}", pin.joint), *pin.position));
  }
  return issues;
}

}  // namespace limber::session
