// Answers of a live linkage that undo and redo bring back.

#include <utility>

#include "engine/session/linkages/live_problem.h"
#include "engine/session/linkages/path_summary.h"

namespace limber::session {

using Kind = CachedEquilibrium::Kind;

void LiveLinkage::come_back_to(const CachedEquilibrium& answer) {
  state_ = good_ = answer.state;
  held_ = good_held_ = answer.held;
  good_report_ = answer.report;
  good_sizes_ = answer.sizes;
  settled_ = answer.is_settled;
  set_sizes(answer.sizes);
  turned_ = 0;
  ahead_.reset();
}

LiveLinkage::Answer LiveLinkage::good_answer() const {
  return std::make_shared<const CachedEquilibrium>(CachedEquilibrium{
      Kind::kReached, good_, good_held_, good_sizes_, good_report_, {}, settled_});
}

LiveLinkage::Outcome LiveLinkage::cached_outcome(const SharedConditions& conditions,
                                                 const Answer& answer) {
  come_back_to(*answer);
  Outcome outcome;
  if (answer->kind == Kind::kStopped) {
    reached_ = answer->reached_before;
    reached_under_ = answer->reached_under.lock();
    settled_under_.reset();
    outcome.report = answer->attempt;
    return outcome;
  }
  reached_ = answer;
  reached_under_ = settled_under_ = conditions;
  outcome.reached = true;
  outcome.report = outcome.path_end = answer->report;
  outcome.report.iterations = outcome.report.corrections = outcome.report.factorizations = 0;
  outcome.report.escapes = 0;
  rods::DeploymentStep step;
  step.progress = 1;
  step.mean_opening_angle = state_.mean_opening_angle();
  step.energy = answer->report.energies.total();
  outcome.path.push_back(step);
  note_step(state_, outcome);
  return outcome;
}

void LiveLinkage::note_reached(const SharedConditions& conditions, const Outcome& outcome) {
  settled_ = true;
  turned_ = 0;
  good_ = state_;
  good_held_ = held_ = map_conditions(*conditions, mapped_, length_unit_);
  good_report_ = outcome.report;
  good_sizes_ = sizes_of(*conditions);
  reached_under_ = settled_under_ = conditions;
  reached_ = good_answer();
  cache_.store(conditions, reached_);
}

/// The shape is as far as it went, or the last equilibrium.
void LiveLinkage::note_stopped(const SharedConditions& conditions, Outcome& outcome) {
  outcome.report.message += describe_request(
      reached_under_ ? *reached_under_ : scene::LinkageConditions(), *conditions, length_unit_);
  settled_under_.reset();
  if (outcome.path.empty()) {
    restore();
  } else {
    good_report_ = outcome.path_end;
    good_ = state_;
    good_held_ = held_;
    good_sizes_ = sizes_of(*conditions);
  }
  CachedEquilibrium stopped = *good_answer();
  stopped.kind = Kind::kStopped;
  stopped.attempt = outcome.report;
  stopped.reached_before = reached_;
  stopped.reached_under = reached_under_;
  cache_.store(conditions, std::make_shared<const CachedEquilibrium>(std::move(stopped)));
}

void LiveLinkage::add_guess(const SharedConditions& conditions, const rods::LinkageState& state) {
  CachedEquilibrium guess = {Kind::kGuess, state,
                             map_conditions(*conditions, mapped_, length_unit_),
                             sizes_of(*conditions), good_report_};
  cache_.store(conditions, std::make_shared<const CachedEquilibrium>(std::move(guess)));
}

}  // namespace limber::session
