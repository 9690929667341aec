#include "engine/rods/equilibrium/deployment_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/degrees.h"

namespace limber::rods::detail {
namespace {

constexpr std::size_t kLongText = 300;  // characters after which events are summed up

const char* name_of(BranchEvent event) {
  switch (event) {
    case BranchEvent::kBranching:
      return "the structure buckled to a stable shape beside";
    case BranchEvent::kLimitPoint:
      return "the structure snapped to another shape (limit point)";
    case BranchEvent::kJump:
      return "the structure jumped to a distant shape";
    case BranchEvent::kNone:
      break;
  }
  return "";
}

}  // namespace

Resistance greatest_resistance(LinkageEquilibrium& equilibrium, const LinkageState& state,
                               const Conditions& held) {
  Resistance greatest;
  for (const JointLoad& load : equilibrium.reactions(state, held)) {
    if (!load.force.isZero(0) && (!greatest.pin || load.force.norm() > greatest.pin->force.norm()))
      greatest.pin = load;
    const bool set = std::any_of(held.angles.begin(), held.angles.end(),
                                 [&](const AngleSetting& a) { return a.joint == load.joint; });
    if (set && load.opening_torque != 0 &&
        (!greatest.angle ||
         std::abs(load.opening_torque) > std::abs(greatest.angle->opening_torque)))
      greatest.angle = load;
  }
  return greatest;
}

std::string describe_events(const std::vector<DeploymentStep>& path) {
  std::string text;
  int more = 0;
  for (const DeploymentStep& step : path) {
    if (step.event == BranchEvent::kNone) continue;
    if (text.size() > kLongText) {
      ++more;
      continue;
    }
    text += fmt::format("{}{} at {:.4g} % of the change (mean angle {:.2f} degrees)",
                        text.empty() ? "" : ", ", name_of(step.event), 100 * step.progress,
                        step.mean_opening_angle * kDegreesPerRadian);
  }
  if (more > 0) text += fmt::format(", and {} more", more);
  return text;
}

}  // namespace limber::rods::detail
