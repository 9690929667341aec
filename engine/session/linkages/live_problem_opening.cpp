// The first shape of a live linkage: the shape of its scene, or the drawing.

#include <utility>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/floating_parts.h"
#include "engine/session/linkages/live_problem.h"

namespace limber::session {
namespace {

using rods::EquilibriumReport;
using rods::EquilibriumStatus;

/// Only the pins that hold joints at their drawn positions.
scene::LinkageConditions pinned_as_drawn(const scene::LinkageConditions& conditions) {
  scene::LinkageConditions drawn;
  for (scene::JointPin pin : conditions.pins) {
    if (pin.position && pin.held == scene::Held::kMotion) continue;
    if (pin.position) pin.held = scene::Held::kAngle;
    pin.position.reset();
    drawn.pins.push_back(pin);
  }
  return drawn;
}

/// The same conditions, with the angles and the places that the shape has.
rods::Conditions held_in(const rods::LinkageState& state, rods::Conditions conditions) {
  const auto joint = [&](int j) -> const auto& {
    return state.joints()[static_cast<std::size_t>(j)];
  };
  if (conditions.mean_opening_angle) conditions.mean_opening_angle = state.mean_opening_angle();
  for (auto& setting : conditions.angles) setting.angle = joint(setting.joint).opening_angle;
  for (auto& pin : conditions.pins)
    if (pin.position) pin.position = joint(pin.joint).position;
  return conditions;
}

/// Shapes may have angles that none can be set to.
bool can_be_held(const rods::LinkageModel& model, const rods::Conditions& conditions) {
  try {
    conditions.validate(model);
  } catch (const Error&) {
    return false;
  }
  return true;
}

}  // namespace

/// Begins in the shape of a scene that has one. It is in equilibrium under its stated conditions,
/// or near one under the requested ones, with its own angles and places.
bool LiveLinkage::begin_in_shape(const scene::LinkageConditions& conditions, const JobContext& job,
                                 Outcome& outcome) {
  const rods::LinkageState given = state_;
  const scene::LinkageConditions& own = linkage_.shape_conditions.value_or(conditions);
  good_sizes_ = sizes_of(own);
  set_sizes(good_sizes_);
  held_ = held_in(state_, map_conditions(own, mapped_, length_unit_));
  EquilibriumReport& report = outcome.report;
  report.status = EquilibriumStatus::kStalled;
  if (can_be_held(model(), held_)) report = equilibrium_.solve(state_, held_, {}, job);
  in_shape_ = report.status == EquilibriumStatus::kCancelled;  // then it begins there again
  settled_ =
      report.converged() && report.turned <= kFarTurn && !rods::overturned(model(), drawn_, state_);
  if (settled_) {
    rods::keep_in_place(model(), {}, held_, given, state_);
    good_report_ = report;
  } else if (in_shape_) {
    state_ = given;
  } else {
    held_ = {};
    state_ = drawn_;
    good_sizes_ = first_sizes_;
    set_sizes(good_sizes_);
  }
  good_ = state_;
  good_held_ = held_;
  return settled_;
}

bool LiveLinkage::recall(const SharedConditions& conditions, const RecalledAnswer& answer) {
  constexpr double kStoredTolerance = 1e-7;  // for shapes that were balanced to 1e-8 when stored
  if (!in_shape_ || (answer.solve_failed && !linkage_.shape_conditions)) return false;
  const scene::LinkageConditions& under =
      answer.solve_failed ? *linkage_.shape_conditions : *conditions;
  const RodSizes before = sizes_, sizes = sizes_of(under);
  set_sizes(sizes);
  const rods::Conditions held = map_conditions(under, mapped_, length_unit_);
  rods::EquilibriumOptions options;
  options.tolerance = kStoredTolerance;
  EquilibriumReport report;
  if (can_be_held(model(), held)) report = equilibrium_.judge(state_, held, options);
  if (!report.converged()) {
    set_sizes(before);
    return false;
  }
  CachedEquilibrium known{CachedEquilibrium::Kind::kReached, state_, held, sizes, report};
  if (answer.solve_failed) {
    known.kind = CachedEquilibrium::Kind::kStopped;
    known.attempt.status = answer.status;
    known.attempt.message = answer.message;
  } else {
    known.report.message = answer.message;
  }
  cache_.store(conditions, std::make_shared<const CachedEquilibrium>(std::move(known)));
  in_shape_ = false;
  return true;
}

scene::LinkageConditions LiveLinkage::conditions_of_shape() const {
  scene::LinkageConditions conditions = scene_conditions(good_held_, mapped_, length_unit_);
  if (good_sizes_.edges.size() > 0) {
    conditions.edge_lengths = good_sizes_.edges;
  } else if (good_sizes_.segments != first_sizes_.segments) {
    conditions.segment_lengths = good_sizes_.segments;
  }
  conditions.section_scales = good_sizes_.sections;
  return conditions;
}

/// Leads to the sizes of a scene that is just opened, from the drawing; joints pinned at their
/// drawn positions stay there. First it goes from an equilibrium to an equilibrium, like a
/// session that gets the sizes from a design. A linkage whose equilibrium is far from its drawing,
/// such as a ring that snaps shut, goes from the drawing itself. If there is no path, it begins
/// with these sizes at once.
bool LiveLinkage::open_with(const RodSizes& target, const scene::LinkageConditions& conditions,
                            const JobContext& job, const OnIterate& on_iterate, Outcome& outcome) {
  held_ = map_conditions(pinned_as_drawn(conditions), mapped_, length_unit_);
  const auto lie = [&] {
    outcome.report = equilibrium_.solve(state_, held_, {}, job);
    refuse_turned_over(outcome.report);
    return outcome.report.converged();
  };
  const auto begin = [&](const RodSizes& sizes) {
    state_ = drawn_;
    set_sizes(sizes);
  };
  const auto cancelled = [&] { return outcome.report.status == EquilibriumStatus::kCancelled; };
  begin(first_sizes_);
  if (lie() && follow_to(target, job, on_iterate, outcome) && lie()) return true;
  if (cancelled()) return false;
  begin(first_sizes_);
  if (follow_to(target, job, on_iterate, outcome)) return true;
  if (cancelled()) return false;
  begin(target);
  return lie();
}

}  // namespace limber::session
