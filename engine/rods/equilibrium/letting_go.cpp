#include "engine/rods/equilibrium/letting_go.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/unknown_scales.h"

namespace limber::rods::detail {
namespace {

// What a step should move: turns [rad], lengths as shares of the linkage's extent. The first is
// judged before it is known how stiff the linkage is.
constexpr double kTurn = 0.08;
constexpr double kShare = 0.02;
// Beyond this a step is tried again with stronger springs, and at last taken for a jump.
constexpr double kFar = 4;
constexpr double kStronger = 8;
constexpr int kMostTries = 8;
// Springs fade at least and at most so much from step to step.
constexpr double kLeastFading = 1.5;
constexpr double kMostFading = 1.0 / 32;
// Of what a step should move: what has gone less far with springs of next to no stiffness is there.
constexpr double kNear = 0.02;
constexpr double kNoStiffness = 1e-4;  // of the first
constexpr int kMostSteps = 400;

}  // namespace

LettingGo::LettingGo(LinkageEquilibrium& equilibrium, const std::vector<JointLoad>& released,
                     Conditions held)
    : equilibrium_(equilibrium),
      bare_(std::move(held)),
      held_(bare_),
      extent_(UnknownScales(equilibrium.model()).extent()),
      stiffness_(first_stiffness(released)) {
  const LinkageModel& model = equilibrium_.model();
  for (int segment = 0; segment < model.variables().segments(); ++segment) {
    for (int vertex = 0; vertex <= model.variables().edges(segment); ++vertex)
      springs_.emplace_back().at = VertexPoint{segment, vertex};
  }
}

/// So stiff that the springs at a joint and around it take its load within a step.
double LettingGo::first_stiffness(const std::vector<JointLoad>& released) const {
  const LinkageModel& model = equilibrium_.model();
  double stiffness = 0;
  for (const JointLoad& load : released) {
    double arm = 0;
    for (const auto& rod : model.graph().joints[static_cast<std::size_t>(load.joint)].segments) {
      for (const int segment : rod) {
        if (segment >= 0)
          arm = std::max(arm, model.graph().segments[static_cast<std::size_t>(segment)].length / 2);
      }
    }
    const double moment = load.moment.norm() + std::abs(load.opening_torque);
    stiffness =
        std::max({stiffness, load.force.norm() / (kShare * extent_), moment / (kTurn * arm * arm)});
  }
  return stiffness;
}

void LettingGo::place_springs(const LinkageState& state) {
  Conditions only;
  only.springs = springs_;
  const ConditionTerms terms(equilibrium_.model(), only);
  held_ = bare_;
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    springs_[i].position = terms.place(state, terms.springs()[i]);
    springs_[i].stiffness = stiffness_;
  }
  held_.springs.insert(held_.springs.end(), springs_.begin(), springs_.end());
}

/// Of what the springs hold, as a share of the linkage's extent.
double LettingGo::farthest(const LinkageState& state) const {
  Conditions only;
  only.springs = springs_;
  const ConditionTerms terms(equilibrium_.model(), only);
  double farthest = 0;
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    farthest =
        std::max(farthest, (terms.place(state, terms.springs()[i]) - springs_[i].position).norm());
  }
  return farthest / extent_;
}

LettingGo::End LettingGo::run(LinkageState& state, const EquilibriumOptions& options,
                              const JobContext& context, const OnStep& on_step,
                              const std::function<void(const EquilibriumReport&)>& on_failure) {
  const double least = kNoStiffness * stiffness_;
  int tries = 0;
  for (int steps = 0; steps < kMostSteps;) {
    place_springs(state);
    LinkageState next = state;
    Step step{equilibrium_.solve(next, held_, options, context), false};
    if (step.report.status == EquilibriumStatus::kCancelled) return End::kCancelled;
    const double moved = std::max(step.report.turned / kTurn, farthest(next) / kShare);
    step.jumped = moved > kFar;
    if ((step.jumped || !step.report.converged()) && ++tries < kMostTries) {
      on_failure(step.report);
      stiffness_ *= kStronger;
      continue;
    }
    if (!step.report.converged()) {
      on_failure(step.report);
      return End::kStuck;
    }
    tries = 0;
    ++steps;
    state = std::move(next);
    on_step(step, state);
    if (moved < kNear && stiffness_ <= least) return End::kLetGo;
    stiffness_ *= std::clamp(moved, kMostFading, kLeastFading);
  }
  return End::kStuck;
}

}  // namespace limber::rods::detail
