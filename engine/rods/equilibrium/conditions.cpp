#include "engine/rods/equilibrium/conditions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/linkage/opening_limit.h"

namespace limber::rods {
namespace {

std::string field(const char* list, std::size_t index, const char* member) {
  return fmt::format("{}[{}].{}", list, index, member);
}

void check_index(const std::string& name, int value, int count, const char* what) {
  if (value >= 0 && value < count) return;
  throw Error(ErrorCode::kOutOfRange, name,
              fmt::format("{} is {}, but there are {} {} (from 0)", name, value, count, what));
}

void check_finite(const std::string& name, const Eigen::Vector3d& value) {
  if (value.allFinite()) return;
  throw Error(ErrorCode::kInvalidArgument, name, fmt::format("{} is not finite", name));
}

void check_angle(const std::string& name, double value, double most) {
  if (std::abs(value) < most) return;
  constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("{} = {:g} degrees cannot be reached: opening angles are set between "
                          "{:g} and {:g} degrees",
                          name, value * kDegreesPerRadian, -most * kDegreesPerRadian,
                          most * kDegreesPerRadian));
}

bool pins_angle(Hold hold) { return hold != Hold::kMotion; }
bool pins_motion(Hold hold) { return hold != Hold::kAngle; }

/// @returns joints whose angle is prescribed
std::set<int> check_joints(const Conditions& conditions, const LinkageGraph& graph) {
  const int joints = static_cast<int>(graph.joints.size());
  std::set<int> pinned;
  std::set<int> angles;
  for (std::size_t i = 0; i < conditions.pins.size(); ++i) {
    const JointPin& pin = conditions.pins[i];
    const std::string name = field("pins", i, "joint");
    check_index(name, pin.joint, joints, "joints");
    if (!pinned.insert(pin.joint).second) {
      throw Error(ErrorCode::kInvalidArgument, name,
                  fmt::format("joint {} is pinned twice", pin.joint));
    }
    if (pins_angle(pin.hold)) angles.insert(pin.joint);
    if (!pin.position) continue;
    check_finite(field("pins", i, "position"), *pin.position);
    if (!pins_motion(pin.hold)) {
      throw Error(
          ErrorCode::kInvalidArgument, field("pins", i, "position"),
          fmt::format("pin {} holds the angle of joint {} only, yet has a position", i, pin.joint));
    }
  }
  for (std::size_t i = 0; i < conditions.angles.size(); ++i) {
    const AngleSetting& setting = conditions.angles[i];
    const std::string name = field("angles", i, "joint");
    check_index(name, setting.joint, joints, "joints");
    check_angle(field("angles", i, "angle"), setting.angle,
                largest_opening(graph, static_cast<std::size_t>(setting.joint)));
    if (!angles.insert(setting.joint).second) {
      throw Error(ErrorCode::kInvalidArgument, name,
                  fmt::format("the opening angle of joint {} is set twice, or pinned and set",
                              setting.joint));
    }
  }
  return angles;
}

void check_spring(const TargetSpring& spring, std::size_t i, const ReducedVariables& variables) {
  if (const auto* joint = std::get_if<JointPoint>(&spring.at)) {
    check_index(field("springs", i, "at.joint"), joint->joint, variables.joints(), "joints");
  } else if (const auto* vertex = std::get_if<VertexPoint>(&spring.at)) {
    check_index(field("springs", i, "at.segment"), vertex->segment, variables.segments(),
                "segments");
    check_index(field("springs", i, "at.vertex"), vertex->vertex,
                variables.edges(vertex->segment) + 1, "vertices");
  } else if (const auto* arc = std::get_if<ArcPoint>(&spring.at)) {
    check_index(field("springs", i, "at.segment"), arc->segment, variables.segments(), "segments");
    if (!(arc->share >= 0 && arc->share <= 1)) {
      throw Error(ErrorCode::kInvalidArgument, field("springs", i, "at.share"),
                  fmt::format("share = {} of a segment; it must be in [0, 1]", arc->share));
    }
  }
  check_finite(field("springs", i, "position"), spring.position);
  if (!(spring.stiffness > 0) || !std::isfinite(spring.stiffness)) {
    throw Error(ErrorCode::kInvalidArgument, field("springs", i, "stiffness"),
                fmt::format("stiffness = {}; it must be positive and finite", spring.stiffness));
  }
}

/// Squares of larger loads overflow.
void check_size(const std::string& name, double size) {
  constexpr double kMaxSize = 1e100;  // largest load that is accepted
  if (size <= kMaxSize) return;
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("is {:.3g}: no more than {:g} can be reckoned with", size, kMaxSize));
}

void check_load(const JointLoad& load, std::size_t i, int joints) {
  check_index(field("loads", i, "joint"), load.joint, joints, "joints");
  check_finite(field("loads", i, "force"), load.force);
  check_finite(field("loads", i, "moment"), load.moment);
  if (!std::isfinite(load.opening_torque)) {
    throw Error(ErrorCode::kInvalidArgument, field("loads", i, "opening_torque"),
                "the opening torque is not finite");
  }
  check_size(field("loads", i, "force"), load.force.cwiseAbs().maxCoeff());
  check_size(field("loads", i, "moment"), load.moment.cwiseAbs().maxCoeff());
  check_size(field("loads", i, "opening_torque"), std::abs(load.opening_torque));
}

}  // namespace

void Conditions::validate(const LinkageModel& model) const {
  const ReducedVariables& variables = model.variables();
  const std::set<int> prescribed = check_joints(*this, model.graph());
  if (mean_opening_angle) {
    double most = 2 * std::numbers::pi;
    for (std::size_t j = 0; j < model.graph().joints.size(); ++j)
      most = std::min(most, largest_opening(model.graph(), j));
    check_angle("mean_opening_angle", *mean_opening_angle, most);
    if (static_cast<int>(prescribed.size()) == variables.joints()) {
      throw Error(ErrorCode::kInvalidArgument, "mean_opening_angle",
                  "the mean opening angle is set, but every opening angle is prescribed");
    }
  }
  for (std::size_t i = 0; i < springs.size(); ++i) check_spring(springs[i], i, variables);
  for (std::size_t i = 0; i < loads.size(); ++i) check_load(loads[i], i, variables.joints());
  check_finite("gravity.acceleration", gravity.acceleration);
  if (!(gravity.mass_per_length >= 0) || !std::isfinite(gravity.mass_per_length)) {
    throw Error(ErrorCode::kInvalidArgument, "gravity.mass_per_length",
                fmt::format("mass_per_length = {}; it must be >= 0", gravity.mass_per_length));
  }
  if (!(shortest_joint_edge > 0 && shortest_joint_edge < 1)) {
    throw Error(ErrorCode::kInvalidArgument, "shortest_joint_edge",
                fmt::format("shortest_joint_edge = {}; it must be in (0, 1)", shortest_joint_edge));
  }
}

}  // namespace limber::rods
