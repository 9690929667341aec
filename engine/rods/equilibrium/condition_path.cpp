#include "engine/rods/equilibrium/condition_path.h"

namespace limber::rods::detail {
namespace {

double blend(double from, double to, double t) { return (1 - t) * from + t * to; }

/// Those that have any strength.
void add_springs(const std::vector<TargetSpring>& springs, double share,
                 std::vector<TargetSpring>& to) {
  if (share <= 0) return;
  for (TargetSpring spring : springs) {
    spring.stiffness *= share;
    to.push_back(spring);
  }
}

void add_loads(const std::vector<JointLoad>& loads, double share, std::vector<JointLoad>& to) {
  for (JointLoad load : loads) {
    load.force *= share;
    load.moment *= share;
    load.opening_torque *= share;
    to.push_back(load);
  }
}

}  // namespace

ConditionPath::ConditionPath(const LinkageState& start, Conditions from, Conditions to)
    : from_(std::move(from)), to_(std::move(to)), mean_angle_(start.mean_opening_angle()) {
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
  result.loads.clear();
  add_loads(from_.loads, 1 - t, result.loads);
  add_loads(to_.loads, t, result.loads);
  // As weights per length: neither need know the other's masses.
  result.gravity.acceleration =
      (1 - t) * from_.gravity.mass_per_length * from_.gravity.acceleration +
      t * to_.gravity.mass_per_length * to_.gravity.acceleration;
  result.gravity.mass_per_length = 1;
  return result;
}

}  // namespace limber::rods::detail
