#include "engine/rods/equilibrium/condition_path.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <variant>

#include "engine/rods/equilibrium/holding.h"

namespace limber::rods::detail {
namespace {

/// Share of the mean angle's moment: moments that differ by less are the same.
constexpr double kEqual = 1e-6;
/// Largest difference of angles that count as equal [rad].
constexpr double kSameAngle = 1e-9;

double blend(double from, double to, double t) { return (1 - t) * from + t * to; }

/// A point of a spring by numbers that can be compared.
std::tuple<std::size_t, int, double> key(const TargetSpring& spring) {
  if (const auto* joint = std::get_if<JointPoint>(&spring.at)) return {0, joint->joint, 0};
  if (const auto* vertex = std::get_if<VertexPoint>(&spring.at))
    return {1, vertex->segment, vertex->vertex};
  const auto& arc = std::get<ArcPoint>(spring.at);
  return {2, arc.segment, arc.share};
}

/// Those that have any strength. Two at one point pull like one between their positions: paths that
/// are begun again and again do not make them more and more.
void add_springs(const std::vector<TargetSpring>& springs, double share,
                 std::vector<TargetSpring>& to) {
  if (share <= 0) return;
  std::map<std::tuple<std::size_t, int, double>, std::size_t> places;
  for (std::size_t i = 0; i < to.size(); ++i) places.emplace(key(to[i]), i);
  for (TargetSpring spring : springs) {
    spring.stiffness *= share;
    const auto [place, is_new] = places.emplace(key(spring), to.size());
    if (is_new) {
      to.push_back(spring);
      continue;
    }
    TargetSpring& other = to[place->second];
    const double sum = other.stiffness + spring.stiffness;
    other.position += spring.stiffness / sum * (spring.position - other.position);
    other.stiffness = sum;
  }
}

/// One for each joint, in the order of joints.
void add_loads(const std::vector<JointLoad>& loads, double share, std::map<int, JointLoad>& to) {
  if (share <= 0) return;
  for (const JointLoad& load : loads) {
    JointLoad& sum = to[load.joint];
    sum.joint = load.joint;
    sum.force += share * load.force;
    sum.moment += share * load.moment;
    sum.opening_torque += share * load.opening_torque;
  }
}

/// Which joints conditions hold by themselves, without the mean angle.
struct Held {
  std::vector<char> motion, angle;
  Held(int joints, const Conditions& conditions)
      : motion(static_cast<std::size_t>(joints), 0), angle(motion) {
    for (const JointPin& pin : conditions.pins) {
      if (pin.hold != Hold::kAngle) motion[pin.joint] = 1;
      if (pin.hold != Hold::kMotion) angle[pin.joint] = 1;
    }
    for (const AngleSetting& setting : conditions.angles) angle[setting.joint] = 1;
  }
};

bool is_load(const JointLoad& load) {
  return !load.force.isZero(0) || !load.moment.isZero(0) || load.opening_torque != 0;
}

/// Components that pins or springs keep in place.
std::vector<char> anchored(const LinkageModel& model, const std::vector<int>& components,
                           const Held& held, const Conditions& conditions) {
  std::vector<char> result(static_cast<std::size_t>(model.graph().components), 0);
  for (std::size_t j = 0; j < components.size(); ++j)
    if (held.motion[j] != 0) result[components[j]] = 1;
  for (const TargetSpring& spring : conditions.springs) {
    int segment = -1;
    if (const auto* joint = std::get_if<JointPoint>(&spring.at)) {
      result[components[joint->joint]] = 1;
    } else if (const auto* vertex = std::get_if<VertexPoint>(&spring.at)) {
      segment = vertex->segment;
    } else if (const auto* arc = std::get_if<ArcPoint>(&spring.at)) {
      segment = arc->segment;
    }
    if (segment >= 0) result[model.graph().segment_components[segment]] = 1;
  }
  return result;
}

}  // namespace

std::vector<JointLoad> released_reactions(const LinkageModel& model,
                                          const std::vector<JointLoad>& reactions,
                                          const Conditions& from, const Conditions& to) {
  const int joints = model.variables().joints();
  const Held before(joints, from), after(joints, to);
  double mean = 0;  // moments of the mean angle before and after
  if (from.mean_opening_angle && to.mean_opening_angle) {
    for (const JointLoad& load : reactions)
      if (before.angle[load.joint] == 0) mean = load.opening_torque;
  }
  std::vector<JointLoad> result;
  for (JointLoad load : reactions) {
    const int j = load.joint;
    if (before.motion[j] == 0 || after.motion[j] != 0) {
      load.force.setZero();
      load.moment.setZero();
    }
    const bool angle = before.angle[j] != 0 || from.mean_opening_angle;
    const double torque = load.opening_torque - mean;
    const bool released =
        angle && after.angle[j] == 0 && std::abs(torque) > kEqual * std::abs(mean);
    load.opening_torque = released ? torque : 0;
    if (is_load(load)) result.push_back(load);
  }
  return result;
}

std::vector<JointLoad> without_pushes(const LinkageModel& model, std::vector<JointLoad> released,
                                      const Conditions& to) {
  const std::vector<int> components = joint_components(model.graph());
  const Held after(model.variables().joints(), to);
  const std::vector<char> fixed = anchored(model, components, after, to);
  for (JointLoad& load : released) {
    if (fixed[components[load.joint]] != 0) continue;
    load.force.setZero();
    load.moment.setZero();
  }
  std::erase_if(released, [](const JointLoad& load) { return !is_load(load); });
  return released;
}

Conditions without_loads_on_released(const LinkageModel& model, Conditions from,
                                     const Conditions& to) {
  const int joints = model.variables().joints();
  const std::vector<int> components = joint_components(model.graph());
  std::vector<char> released = anchored(model, components, Held(joints, from), from);
  const std::vector<char> after = anchored(model, components, Held(joints, to), to);
  for (std::size_t c = 0; c < released.size(); ++c)
    if (after[c] != 0) released[c] = 0;
  if (std::find(released.begin(), released.end(), 1) == released.end()) return from;
  for (JointLoad& load : from.loads) {
    if (released[components[load.joint]] == 0) continue;
    load.force.setZero();
    load.moment.setZero();
  }
  std::erase_if(from.loads, [](const JointLoad& load) { return !is_load(load); });
  from.gravity.acceleration.setZero();
  return from;
}

ConditionPath::ConditionPath(const LinkageState& start, Conditions from, Conditions to,
                             std::vector<JointLoad> released)
    : from_(std::move(from)),
      to_(std::move(to)),
      released_(std::move(released)),
      mean_angle_(start.mean_opening_angle()) {
  for (const AngleSetting& setting : to_.angles)
    angles_.push_back(start.joints()[setting.joint].opening_angle);
  for (const JointPin& pin : to_.pins) positions_.push_back(start.joints()[pin.joint].position);
}

Conditions ConditionPath::at(double t) const {
  Conditions result = to_;
  if (t >= 1) return result;
  for (std::size_t i = 0; i < angles_.size(); ++i)
    result.angles[i].angle = blend(angles_[i], to_.angles[i].angle, t);
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (to_.pins[i].position)
      result.pins[i].position = (1 - t) * positions_[i] + t * *to_.pins[i].position;
  }
  if (to_.mean_opening_angle)
    result.mean_opening_angle = blend(mean_angle_, *to_.mean_opening_angle, t);
  result.springs.clear();
  add_springs(from_.springs, 1 - t, result.springs);
  add_springs(to_.springs, t, result.springs);
  std::map<int, JointLoad> loads;
  add_loads(from_.loads, 1 - t, loads);
  add_loads(to_.loads, t, loads);
  add_loads(released_, 1 - t, loads);
  result.loads.clear();
  for (const auto& [joint, load] : loads) result.loads.push_back(load);
  // As weights per length: neither need know the other's masses.
  result.gravity.acceleration =
      (1 - t) * from_.gravity.mass_per_length * from_.gravity.acceleration +
      t * to_.gravity.mass_per_length * to_.gravity.acceleration;
  result.gravity.mass_per_length = 1;
  return result;
}

bool ConditionPath::stays() const {
  for (std::size_t i = 0; i < angles_.size(); ++i)
    if (std::abs(angles_[i] - to_.angles[i].angle) > kSameAngle) return false;
  for (std::size_t i = 0; i < positions_.size(); ++i)
    if (to_.pins[i].position && *to_.pins[i].position != positions_[i]) return false;
  if (to_.mean_opening_angle && std::abs(*to_.mean_opening_angle - mean_angle_) > kSameAngle)
    return false;
  const Gravity &before = from_.gravity, &after = to_.gravity;
  return released_.empty() && from_.springs == to_.springs && from_.loads == to_.loads &&
         before.mass_per_length * before.acceleration == after.mass_per_length * after.acceleration;
}

}  // namespace limber::rods::detail
