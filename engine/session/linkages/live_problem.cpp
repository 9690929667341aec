#include "engine/session/linkages/live_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/equilibrium/floating_parts.h"
#include "engine/rods/linkage/drawn_extent.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/session/linkages/path_summary.h"
#include "engine/session/linkages/rest_shape.h"
#include "engine/session/linkages/size_path.h"

namespace limber::session {
namespace {

using rods::EquilibriumReport;
using rods::EquilibriumStatus;

/// Largest changes in one solve: beyond them, the linkage might jump to another branch.
constexpr double kFarAngle = 2 * kDegree;  // [rad]
constexpr double kFarShare = 0.01;         // of the linkage's extent
constexpr double kTurnOfStep = 0.05;       // of steps, where one solve turned too far [rad]
constexpr double kMaxSteps = 200;  // a pin far away is no reason to remember every step there

}  // namespace

LiveLinkage::LiveLinkage(const scene::Linkage& linkage, const JobContext& job)
    : mapped_(map_linkage(linkage)),
      state_(rest_shape(mapped_, linkage.rest_lengths, job)),
      drawn_(state_),
      shape_(mapped_, linkage),
      linkage_(linkage),
      reach_(mapped_.model.graph()),
      first_sizes_{mapped_.model.segment_lengths()},
      sizes_(first_sizes_),
      statics_(std::make_shared<const LinkageStatics>(mapped_, linkage)),
      length_unit_(linkage.length_unit_in_metres),
      extent_(rods::drawn_extent(mapped_.model.graph())),
      equilibrium_(mapped_.model),
      good_(state_),
      good_sizes_(first_sizes_),
      in_shape_(linkage.shape.has_value()) {
  if (in_shape_) good_ = state_ = rods::LinkageState(mapped_.model, *linkage.shape);
}

RodSizes LiveLinkage::sizes_of(const scene::LinkageConditions& conditions) const {
  return sizes_under(conditions, first_sizes_.segments, mapped_.model.edge_numbers());
}

void LiveLinkage::set_sizes(const RodSizes& sizes) {
  if (sizes == sizes_) return;
  session::set_sizes(mapped_.model, sizes);
  sizes_ = sizes;
  statics_ = std::make_shared<const LinkageStatics>(mapped_, linkage_);
}

/// A joint that has turned over since the last equilibrium, or the drawing where there is none yet:
/// an interrupted solve may have left it so.
void LiveLinkage::refuse_turned_over(EquilibriumReport& report) {
  const auto joint = rods::overturned(model(), settled_ ? good_ : drawn_, state_);
  if (!joint) return;
  if (report.converged()) {
    report.status = EquilibriumStatus::kStalled;
    report.message = fmt::format(
        "joint {} would turn over: request less, or set the angle of that joint", *joint);
  } else if (settled_ && report.status == EquilibriumStatus::kCancelled) {
    restore();
  }
}

/// To other sizes of rods, under the conditions that the shape is held under. If no equilibrium is
/// found along the path, the outcome reports it.
bool LiveLinkage::follow_to(const RodSizes& target, const JobContext& job,
                            const OnIterate& on_iterate, Outcome& outcome) {
  outcome.report = target == sizes_ ? equilibrium_.solve(state_, held_, {}, job)
                                    : follow_sizes(mapped_.model, sizes_, equilibrium_, state_,
                                                   held_, target, job, on_iterate);
  statics_ = std::make_shared<const LinkageStatics>(mapped_, linkage_);
  EquilibriumReport& report = outcome.report;
  refuse_turned_over(report);
  if (report.converged()) return true;
  report.message = "while rod sizes changed to the requested ones: " + report.message;
  return false;
}

/// To other sizes of rods. If the present conditions block the path, the requested conditions may
/// allow it: these are then applied first.
bool LiveLinkage::bring_sizes(const RodSizes& target, const scene::LinkageConditions& conditions,
                              const rods::Conditions& then_held, const JobContext& job,
                              const OnIterate& on_iterate, Outcome& outcome) {
  // If the last solve was interrupted, the state has them, but the last equilibrium has others.
  if (target == sizes_ && target == good_sizes_) return true;
  bool there = settled_ ? follow_to(target, job, on_iterate, outcome)
                        : open_with(target, conditions, job, on_iterate, outcome);
  if (!there && settled_ && outcome.report.status != EquilibriumStatus::kCancelled) {
    restore();
    Outcome first;
    go(then_held, job, on_iterate, first);
    if (first.reached) {
      held_ = then_held;
      there = follow_to(target, job, on_iterate, outcome);
    } else if (first.report.status == EquilibriumStatus::kCancelled) {
      outcome.report.status = EquilibriumStatus::kCancelled;
    }
  }
  if (!there) return false;
  // A later restore returns to this shape, not to the shape of other rods.
  turned_ = 0;
  good_ = state_;
  good_held_ = held_;
  good_report_ = outcome.report;
  good_sizes_ = target;
  settled_under_.reset();
  return true;
}

/// The share of the path to these conditions that one solve may take, in (0, 1].
double LiveLinkage::share_of_step(const rods::Conditions& target) const {
  double steps = 1;
  const auto note_angle = [&](double from, double to) {
    steps = std::max(steps, std::abs(to - from) / kFarAngle);
  };
  if (target.mean_opening_angle)
    note_angle(state_.mean_opening_angle(), *target.mean_opening_angle);
  for (const auto& setting : target.angles) {
    note_angle(state_.joints()[static_cast<std::size_t>(setting.joint)].opening_angle,
               setting.angle);
  }
  for (const auto& pin : target.pins) {
    if (!pin.position) continue;
    const auto& joint = state_.joints()[static_cast<std::size_t>(pin.joint)];
    steps = std::max(steps, (*pin.position - joint.position).norm() / (kFarShare * extent_));
  }
  return 1 / std::min(steps, kMaxSteps);
}

/// In one solve.
void LiveLinkage::go_straight(const rods::Conditions& target, const JobContext& job,
                              const OnIterate& on_iterate, Outcome& outcome) {
  const rods::LinkageState before = state_;
  outcome.report =
      equilibrium_.solve(state_, target, {}, job, [&](int, const rods::LinkageState& state) {
        iterate_ = &state;
        on_iterate();
        iterate_ = nullptr;
      });
  rods::keep_in_place(model(), held_, target, before, state_);
  const EquilibriumReport& report = outcome.report;
  outcome.reached = report.converged() && !rods::overturned(model(), good_, state_);
  turned_ += report.turned;
  if (!outcome.reached) return;
  rods::DeploymentStep step;
  step.progress = 1;
  step.mean_opening_angle = state_.mean_opening_angle();
  step.energy = report.energies.total();
  step.iterations = report.iterations;
  step.negative_eigenvalues = report.negative_eigenvalues;
  step.prediction_error = report.turned;
  if (report.escapes > 0) step.event = rods::BranchEvent::kBranching;
  outcome.path.push_back(step);
  note_step(state_, outcome);
}

void LiveLinkage::note_step(const rods::LinkageState& state, Outcome& outcome) const {
  outcome.frames.push_back(shape_.coordinates(mapped_.model, state));
  outcome.strains.push_back(statics_->strains(state));
}

/// Step by step.
void LiveLinkage::lead(const rods::Conditions& target, double step, const JobContext& job,
                       const OnIterate& on_iterate, Outcome& outcome) {
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = std::min(step, 0.25);
  options.smallest_step = options.first_step / 64;
  // Extrapolated is from shapes as they were found; shown are those that stay in place.
  rods::LinkageState shown = state_;
  rods::DeploymentReport report =
      rods::deploy(equilibrium_, state_, held_, target, options, job,
                   [&](const rods::DeploymentStep&, const rods::LinkageState& state) {
                     const rods::LinkageState before = std::exchange(shown, state);
                     rods::keep_in_place(model(), held_, target, before, shown);
                     note_step(shown, outcome);
                     iterate_ = &shown;
                     on_iterate();
                     iterate_ = nullptr;
                   });
  rods::keep_in_place(model(), held_, target, shown, state_);
  if (!outcome.frames.empty()) {  // the last is the shape, in every digit
    outcome.frames.pop_back();
    outcome.strains.pop_back();
    note_step(state_, outcome);
  }
  EquilibriumReport& sum = outcome.report;
  const int iterations = sum.iterations, corrections = sum.corrections;
  const int factorizations = sum.factorizations;
  sum = report.end;
  sum.iterations = iterations + report.iterations;
  sum.corrections = corrections + report.corrections;
  sum.factorizations = factorizations + report.factorizations;
  if (!report.message.empty())
    sum.message = report.message + describe_resistance(report.resistance, length_unit_);
  held_ = std::move(report.held);
  turned_ = 0;
  outcome.path_end = report.reached;
  outcome.path = std::move(report.path);
  outcome.reached = report.status == rods::DeploymentStatus::kReached && report.end.converged();
  if (report.status == rods::DeploymentStatus::kCancelled)
    sum.status = EquilibriumStatus::kCancelled;
}

void LiveLinkage::restore() {
  iterate_ = nullptr;
  ahead_.reset();
  turned_ = 0;
  state_ = good_;
  held_ = good_held_;
  set_sizes(good_sizes_);
}

/// Once more, from where it was and slowly. If that does not reach the target, the first
/// equilibrium is the result: a jump.
void LiveLinkage::go_again(const rods::Conditions& target, const JobContext& job,
                           const OnIterate& on_iterate, Outcome& outcome) {
  Outcome slow;
  slow.report = outcome.report;
  const double turns = std::isfinite(slow.report.turned) ? slow.report.turned : 1;
  const rods::LinkageState found = state_;
  restore();
  lead(target, 1 / std::clamp(turns / kTurnOfStep, 4.0, kMaxSteps), job, on_iterate, slow);
  if (slow.reached || !outcome.reached || slow.report.status == EquilibriumStatus::kCancelled) {
    outcome = std::move(slow);
    return;
  }
  state_ = found;
  outcome.path.back().event = rods::BranchEvent::kJump;
  outcome.report.message +=
      "; the structure jumped to this distant shape, and no continuous path to it was found: " +
      slow.report.message;
}

void LiveLinkage::stay_near() {
  if (is_slow() && !ahead_) {
    // The factor near the iterate belongs to the shown shape.
    ahead_ = state_;
    if (!ahead_steps_) ahead_steps_.emplace(mapped_.model);
    std::swap(equilibrium_, *ahead_steps_);
  }
  if (turned_ <= kFarTurn) return;
  std::optional<rods::LinkageState> ahead = std::move(ahead_);
  restore();
  ahead_ = std::move(ahead);
}

/// Shows a shape under the conditions, advanced from the last shown one by one step with the
/// available factor. @returns whether anything was shown
bool LiveLinkage::show_ahead(const scene::LinkageConditions& conditions, const JobContext& job,
                             const OnIterate& on_iterate) {
  if (!ahead_ || !(sizes_of(conditions) == sizes_)) return false;
  rods::EquilibriumOptions options;
  options.max_iterations = 1;
  bool is_shown = false;
  (void)ahead_steps_->solve(*ahead_, map_conditions(conditions, mapped_, length_unit_), options,
                            job, [&](int, const rods::LinkageState& state) {
                              is_shown = true;
                              iterate_ = &state;
                              on_iterate();
                              iterate_ = nullptr;
                            });
  return is_shown;
}

EquilibriumReport LiveLinkage::report_of_shape(const EquilibriumReport& attempt) const {
  EquilibriumReport report = good_report_;
  report.status = attempt.status;
  report.message = attempt.message;
  report.iterations = attempt.iterations;
  report.corrections = attempt.corrections;
  report.factorizations = attempt.factorizations;
  report.escapes = attempt.escapes;
  return report;
}

/// In one solve, or in steps where the path is long.
void LiveLinkage::go(const rods::Conditions& target, const JobContext& job,
                     const OnIterate& on_iterate, Outcome& outcome) {
  const double step = share_of_step(target);
  if (step < 1) return lead(target, step, job, on_iterate, outcome);
  go_straight(target, job, on_iterate, outcome);
  const bool far = settled_ && turned_ > kFarTurn;
  const bool hopeless = outcome.report.status == EquilibriumStatus::kCancelled ||
                        outcome.report.status == EquilibriumStatus::kUnbalanced;
  if (!hopeless && (far || !outcome.reached)) go_again(target, job, on_iterate, outcome);
}

/// Pins that no rods reach between, those that hold a joint where it is among them.
std::string LiveLinkage::contradiction(const scene::LinkageConditions& conditions) const {
  const auto issues =
      reach_.check(conditions, mapped_.model.segment_lengths(), rods::joint_positions(state_));
  return issues.empty() ? "" : issues.front().message;
}

void LiveLinkage::attempt(const scene::LinkageConditions& conditions,
                          const rods::Conditions& target, const RodSizes& sizes,
                          const JobContext& job, const OnIterate& on_iterate, Outcome& outcome) {
  std::string remark;
  if (in_shape_ && !begin_in_shape(conditions, job, outcome)) {
    if (outcome.report.status == EquilibriumStatus::kCancelled) return;
    remark = "the scene's shape is near no equilibrium: the linkage was opened as drawn";
  }
  if (bring_sizes(sizes, conditions, target, job, on_iterate, outcome)) {
    outcome.report.message = contradiction(conditions);
    if (outcome.report.message.empty()) {
      // Shares of segments are of their rest lengths, which may be others by now.
      const rods::Conditions here = map_conditions(conditions, mapped_, length_unit_);
      const rods::LinkageState before = state_;
      const bool was_settled = settled_;
      std::string erection;
      if (!erect(conditions, here, job, on_iterate, outcome, erection))
        go(here, job, on_iterate, outcome);
      std::string& message = outcome.report.message;
      const auto add = [&](const std::string& text) {
        if (!text.empty()) message += (message.empty() ? "" : "; ") + text;
      };
      add(erection);
      if (outcome.reached && was_settled) add(describe_shape_reached(conditions, before, outcome));
    } else {
      outcome.report.status = EquilibriumStatus::kStalled;
    }
  }
  if (remark.empty()) return;
  std::string& message = outcome.report.message;
  message = message.empty() ? remark : remark + "; " + message;
}

/// Once from where the shape is, and where that is no equilibrium, once more from the last one:
/// there may be no path from where the last solve stopped.
LiveLinkage::Outcome LiveLinkage::attempt_from_here(const SharedConditions& conditions,
                                                    const JobContext& job,
                                                    const OnIterate& on_iterate) {
  const rods::Conditions target = map_conditions(*conditions, mapped_, length_unit_);
  const RodSizes sizes = sizes_of(*conditions);
  const bool astray = reached_ && !settled_under_;
  Outcome outcome;
  attempt(*conditions, target, sizes, job, on_iterate, outcome);
  const auto failed = [](const Outcome& tried) {
    return !tried.reached && tried.report.status != EquilibriumStatus::kCancelled;
  };
  if (!astray || !failed(outcome)) return outcome;
  const rods::LinkageState stopped = state_;
  const rods::Conditions stopped_held = held_;
  come_back_to(*reached_);
  Outcome again;
  attempt(*conditions, target, sizes, job, on_iterate, again);
  if (!failed(again) || !again.path.empty() || outcome.path.empty()) return again;
  state_ = stopped;
  held_ = stopped_held;
  set_sizes(sizes);
  return outcome;
}

LiveLinkage::Outcome LiveLinkage::solve(const SharedConditions& conditions, const JobContext& job,
                                        const OnIterate& on_iterate,
                                        const std::vector<SharedConditions>& origins) {
  LIMBER_DEMAND(conditions != nullptr);
  if (const Answer answer = cache_.find(conditions)) {
    if (answer->kind != CachedEquilibrium::Kind::kGuess) return cached_outcome(conditions, answer);
    come_back_to(*answer);
  } else {
    for (const SharedConditions& origin : origins) {
      const Answer nearest = cache_.find(origin);
      if (!nearest) continue;
      (void)cached_outcome(origin, nearest);
      break;
    }
  }
  // Iterates of the solve would be behind the shape that is shown already.
  const bool is_ahead = show_ahead(*conditions, job, on_iterate);
  std::optional<rods::LinkageState> ahead = std::move(ahead_);
  ahead_.reset();
  Outcome outcome = attempt_from_here(conditions, job, is_ahead ? OnIterate([] {}) : on_iterate);
  if (outcome.report.status == EquilibriumStatus::kCancelled) ahead_ = std::move(ahead);
  if (outcome.reached) {
    note_reached(conditions, outcome);
  } else if (outcome.report.status != EquilibriumStatus::kCancelled) {
    note_stopped(conditions, outcome);
  }
  return outcome;
}

}  // namespace limber::session
