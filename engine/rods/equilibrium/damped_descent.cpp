#include "engine/rods/equilibrium/damped_descent.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/rods/equilibrium/condition_terms.h"

namespace limber::rods::detail {
namespace {

// None of these numbers is known to have been tuned.

// Intended motion of a step: turns [rad], lengths as shares of the linkage's extent.
constexpr double kTurn = 0.08;
constexpr double kDampingShare = 0.02;  // of the extent
// A step that moves by more than this multiple is tried again with springs stiffer by a factor, so
// many times at most, and then taken for a jump.
constexpr double kFarFactor = 4;
constexpr double kStronger = 8;  // factor of the springs' stiffness
constexpr int kMaxTries = 8;     // before a step is taken for a jump
// Newton steps after which such a try is given up.
constexpr int kDescentPatience = 15;
// Factors by which springs get weaker or stiffer from step to step, at most.
constexpr double kMaxFading = 1.0 / 32;
constexpr double kMaxGrowth = 1.5;  // of the stiffness, from step to step
// The same, of those that had to be made stronger: something falls where they are too weak.
constexpr double kCarefulFading = 0.4;
// Share of a step's intended motion: a shape that moves less with springs of next to no stiffness
// has arrived.
constexpr double kNearMinimum = 0.02;
constexpr double kNoStiffness = 1e-4;  // of the first stiffness
constexpr int kMaxSteps = 400;         // of one descent

}  // namespace

DampedDescent::DampedDescent(LinkageEquilibrium& equilibrium, Conditions conditions)
    : equilibrium_(equilibrium),
      scales_(equilibrium.model()),
      bare_(std::move(conditions)),
      held_(bare_),
      increment_(Eigen::VectorXd::Zero(equilibrium.model().variables().size())) {
  const ReducedVariables& variables = equilibrium.model().variables();
  double length = 0;
  for (int segment = 0; segment < variables.segments(); ++segment) {
    length += equilibrium.model().graph().segments[segment].length / variables.segments();
    for (int vertex = 0; vertex <= variables.edges(segment); ++vertex)
      springs_.emplace_back().at = VertexPoint{segment, vertex};
  }
  stiffness_ = scales_.bending() / (length * length * length);
  least_ = kNoStiffness * stiffness_;
}

void DampedDescent::take_over(const std::vector<JointLoad>& loads) {
  const LinkageGraph& graph = equilibrium_.model().graph();
  double stiffness = 0;
  for (const JointLoad& load : loads) {
    double arm = 0;
    for (const auto& rod : graph.joints[load.joint].segments) {
      for (const int segment : rod)
        if (segment >= 0) arm = std::max(arm, graph.segments[segment].length / 2);
    }
    const double moment = load.moment.norm() + std::abs(load.opening_torque);
    stiffness = std::max({stiffness, load.force.norm() / (kDampingShare * scales_.extent()),
                          moment / (kTurn * arm * arm)});
  }
  if (!(stiffness > 0)) return;
  stiffness_ = stiffness;
  least_ = kNoStiffness * stiffness;
}

void DampedDescent::place_springs(const LinkageState& state) {
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

/// A vertex from where its spring holds it, as a share of the linkage's extent.
double DampedDescent::farthest(const LinkageState& state) const {
  double farthest = 0;
  for (const TargetSpring& spring : springs_) {
    const auto& at = std::get<VertexPoint>(spring.at);
    const Eigen::Vector3d here = state.vertex(equilibrium_.model(), at.segment, at.vertex);
    farthest = std::max(farthest, (here - spring.position).norm());
  }
  return farthest / scales_.extent();
}

DampedDescent::End DampedDescent::run(LinkageState& state, const EquilibriumOptions& options,
                                      const JobContext& context, const OnStep& on_step,
                                      const OnFailure& on_failure, const Allows& allows) {
  int tries = 0;
  double too_weak = 0;  // springs that let the shape fall from near here
  for (int steps = 0; steps < kMaxSteps;) {
    place_springs(state);
    LinkageState next = state;
    EquilibriumOptions limits = options;
    if (tries + 1 < kMaxTries)
      limits.max_iterations = std::min(limits.max_iterations, kDescentPatience);
    Step step{equilibrium_.solve(next, held_, limits, context)};
    if (step.report.status == EquilibriumStatus::kCancelled) return End::kCancelled;
    step.turned = step.report.turned;
    const double moved = std::max(step.turned / kTurn, farthest(next) / kDampingShare);
    step.jumped = moved > kFarFactor;
    if ((step.jumped || !step.report.converged()) && ++tries < kMaxTries) {
      on_failure(step.report);
      too_weak = std::max(too_weak, stiffness_);
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
    increment_ += equilibrium_.last_increment();
    on_step(step, state);
    if (allows && !allows(state)) return End::kForbidden;
    if (stiffness_ <= too_weak) too_weak = 0;
    // Nothing pushes it, be that a minimum or a saddle.
    if (moved < kNearMinimum &&
        (too_weak == 0 ? stiffness_ <= least_ : step.report.iterations == 0))
      return End::kThere;
    stiffness_ *= std::clamp(moved, too_weak == 0 ? kMaxFading : kCarefulFading, kMaxGrowth);
  }
  return End::kStuck;
}

}  // namespace limber::rods::detail
