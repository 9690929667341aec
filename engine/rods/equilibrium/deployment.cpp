#include "engine/rods/equilibrium/deployment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/condition_path.h"
#include "engine/rods/equilibrium/prediction.h"
#include "engine/rods/equilibrium/unknown_scales.h"

namespace limber::rods {
namespace {

void check_share(const char* name, double value) {
  if (value > 0 && value <= 1) return;
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("{} must be in (0, 1], got {}", name, value));
}

class Deployment {
 public:
  Deployment(LinkageEquilibrium& equilibrium, LinkageState& state, const Conditions& from,
             const Conditions& to, const DeploymentOptions& options)
      : equilibrium_(equilibrium),
        model_(equilibrium.model()),
        scales_(equilibrium.model()),
        state_(state),
        path_(state, from, to),
        options_(options),
        length_(std::min(options.first_step, options.largest_step)) {}

  DeploymentReport run(const JobContext& context, const StepCallback& on_step) {
    while (progress_ < 1) {
      if (!advance(context)) break;
      if (on_step) on_step(report_.path.back(), state_);
      if (context.progress) context.progress("deploying", progress_);
    }
    if (report_.status == DeploymentStatus::kReached && report_.message.empty()) {
      report_.message =
          report_.jumps == 0
              ? "reached without a jump"
              : fmt::format("reached; the branch changed {} times by a jump", report_.jumps);
    }
    return report_;
  }

 private:
  struct Trial {
    LinkageState state;
    EquilibriumReport report;
    Eigen::VectorXd increment;
    double error = 0;
    bool predicted = false;
  };

  Trial attempt(double length, bool last, const JobContext& context) {
    Trial trial{state_, {}, {}, 0, false};
    Eigen::VectorXd guess;
    if (prediction_.possible()) {
      guess = prediction_.over(length);
      trial.predicted = scales_.largest_turn(model_, state_, guess) < options_.last.largest_turn;
    }
    if (trial.predicted) trial.state = state_.moved(model_, guess);
    EquilibriumOptions options = options_.last;
    if (!last) options.tolerance = std::max(options.tolerance, options_.step_tolerance);
    if (shortenable(length))
      options.max_iterations = std::min(options.max_iterations, options_.patience);
    const Conditions conditions = path_.at(progress_ + length);
    trial.report = equilibrium_.solve(trial.state, conditions, options, context);
    trial.increment = equilibrium_.last_increment();
    if (trial.report.status == EquilibriumStatus::kIterationLimit && trial.report.escapes > 0) {
      // The branch has lost its stability: a shorter step would only come here again.
      const EquilibriumReport first = trial.report;
      options.max_iterations = 10 * options_.last.max_iterations;
      trial.report = equilibrium_.solve(trial.state, conditions, options, context);
      trial.increment += equilibrium_.last_increment();
      trial.report.iterations += first.iterations;
      trial.report.corrections += first.corrections;
      trial.report.factorizations += first.factorizations;
      trial.report.escapes += first.escapes;
    }
    report_.iterations += trial.report.iterations;
    report_.corrections += trial.report.corrections;
    report_.factorizations += trial.report.factorizations;
    trial.error = scales_.largest_turn(model_, state_, trial.increment);
    if (trial.predicted) trial.increment += guess;
    return trial;
  }

  [[nodiscard]] bool shortenable(double length) const {
    return length > 1.5 * options_.smallest_step;
  }

  /// One step, shorter if need be. @returns whether there is a next one
  bool advance(const JobContext& context) {
    for (;;) {
      const bool last = progress_ + length_ > 1 - 1e-9;
      if (last) length_ = 1 - progress_;
      Trial trial = attempt(length_, last, context);
      if (trial.report.status == EquilibriumStatus::kCancelled) {
        report_.status = DeploymentStatus::kCancelled;
        report_.message = "cancelled by the caller";
        return false;
      }
      const bool jumped = trial.error > options_.jump_turn;
      // A branch that has lost its stability is gone, however short the step.
      const bool lost = trial.report.converged() && trial.report.escapes > 0;
      if ((jumped || !trial.report.converged()) && !lost && shortenable(length_)) {
        ++report_.steps_shortened;
        length_ /= 2;
        continue;
      }
      return accept(std::move(trial), jumped, last);
    }
  }

  bool accept(Trial trial, bool jumped, bool last) {
    const EquilibriumReport& found = trial.report;
    progress_ = last ? 1 : progress_ + length_;
    state_ = std::move(trial.state);
    DeploymentStep step;
    step.progress = progress_;
    step.mean_opening_angle = state_.mean_opening_angle();
    step.energy = found.energies.total();
    step.iterations = found.iterations;
    step.negative_eigenvalues = found.negative_eigenvalues;
    step.prediction_error = trial.error;
    if (found.escapes > 0) step.event = BranchEvent::kBranching;
    if (jumped) step.event = BranchEvent::kJump;
    report_.path.push_back(step);
    report_.end = found;
    ++report_.steps;
    if (jumped) ++report_.jumps;
    if (!found.converged()) {
      ++report_.steps_failed;
      report_.status = DeploymentStatus::kStopped;
      report_.message = fmt::format("stopped at {:.4f} of the way: {}", progress_, found.message);
      return false;
    }
    if (step.event != BranchEvent::kNone) {
      prediction_.clear();
    } else {
      prediction_.add(length_, trial.increment);
    }
    if (found.iterations <= options_.patience / 6)
      length_ = std::min(2 * length_, options_.largest_step);
    return true;
  }

  LinkageEquilibrium& equilibrium_;
  const LinkageModel& model_;
  detail::UnknownScales scales_;
  LinkageState& state_;
  detail::ConditionPath path_;
  const DeploymentOptions& options_;
  detail::Prediction prediction_;
  double progress_ = 0;
  double length_;
  DeploymentReport report_;
};

}  // namespace

void DeploymentOptions::validate() const {
  check_share("first_step", first_step);
  check_share("largest_step", largest_step);
  check_share("smallest_step", smallest_step);
  check_share("step_tolerance", step_tolerance);
  if (!(jump_turn > 0)) {
    throw Error(ErrorCode::kInvalidArgument, "jump_turn",
                fmt::format("jump_turn must be > 0, got {}", jump_turn));
  }
  if (patience <= 0) {
    throw Error(ErrorCode::kInvalidArgument, "patience",
                fmt::format("patience must be > 0, got {}", patience));
  }
  last.validate();
}

DeploymentReport deploy(LinkageEquilibrium& equilibrium, LinkageState& state,
                        const Conditions& from, const Conditions& to,
                        const DeploymentOptions& options, const JobContext& context,
                        const StepCallback& on_step) {
  options.validate();
  from.validate(equilibrium.model());
  to.validate(equilibrium.model());
  return Deployment(equilibrium, state, from, to, options).run(context, on_step);
}

DeploymentReport deploy(LinkageEquilibrium& equilibrium, LinkageState& state, const Conditions& to,
                        const DeploymentOptions& options, const JobContext& context,
                        const StepCallback& on_step) {
  return deploy(equilibrium, state, {}, to, options, context, on_step);
}

}  // namespace limber::rods
