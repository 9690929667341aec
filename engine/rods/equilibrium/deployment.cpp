#include "engine/rods/equilibrium/deployment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/rods/equilibrium/condition_path.h"
#include "engine/rods/equilibrium/damped_descent.h"
#include "engine/rods/equilibrium/deployment_text.h"
#include "engine/rods/equilibrium/equilibrium_text.h"
#include "engine/rods/equilibrium/floating_parts.h"
#include "engine/rods/equilibrium/prediction.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "engine/rods/linkage/opening_limit.h"

namespace limber::rods {
namespace {

void check_share(const char* name, double value) {
  if (value > 0 && value <= 1) return;
  throw Error(ErrorCode::kInvalidArgument, name,
              fmt::format("{} must be in (0, 1], got {}", name, value));
}

/// Above this share of its squared length, weighed, the path went along the softest direction.
constexpr double kAlongSoftest = 0.5;

// Share of the step tolerance: forces hardly push a shape down from where its branch is just lost.
constexpr double kDescentTolerance = 0.01;
// Iterations in which a branch beside one that lost its stability is reached, if it is near.
constexpr int kNearBranch = 12;
// The same for one that is far, before the search for it as in a medium that resists.
constexpr int kFarBranch = 100;
// The place where a branch is lost is located to this part of a step.
constexpr double kLostSteps = 4;
constexpr double kNoProgress = std::numeric_limits<double>::infinity();  // no loss is known
// Steps whose places and velocities tell where the next one goes, and how far beside a place its
// velocity is taken, of a step.
constexpr std::size_t kPlaces = 2;
constexpr double kAhead = 1e-3;  // of a step
// A saddle that is left by less than this is due to the remaining forces, not to the structure.
constexpr double kBeside = 1e-3;  // [rad]

class Deployment {
 public:
  Deployment(LinkageEquilibrium& equilibrium, LinkageState& state, const Conditions& from,
             const Conditions& to, const DeploymentOptions& options)
      : equilibrium_(equilibrium),
        model_(equilibrium.model()),
        scales_(equilibrium.model()),
        state_(state),
        from_(detail::without_loads_on_released(model_, from, to)),
        released_(detail::released_reactions(model_, equilibrium.reactions(state, from), from, to)),
        path_(state, from_, to, {}),
        start_(state),
        to_(to),
        options_(options),
        length_(std::min(options.first_step, options.largest_step)) {
    report_.held = from;
  }

  DeploymentReport run(const JobContext& context, const StepCallback& on_step) {
    const bool going = release(context, on_step);
    tenth_iterations_ = report_.iterations;
    while (going && progress_ < 1) {
      if (!advance(context)) break;
      if (on_step) on_step(report_.path.back(), state_);
      if (context.progress) context.progress("deploying", progress_);
    }
    if (progress_ > 0) report_.held = path_.at(progress_);
    if (report_.status == DeploymentStatus::kReached) report_.message = "reached";
    if (report_.status == DeploymentStatus::kReached && !report_.end.is_minimum)
      report_.message += fmt::format("; {}", detail::kSlowMotionsOnly);
    const std::string events = detail::describe_events(report_.path);
    if (!events.empty()) report_.message += "; " + events;
    return report_;
  }

 private:
  struct Trial {
    LinkageState state;
    EquilibriumReport report;
    Eigen::VectorXd increment;
    double error = 0;
    double beside = 0;  // the same without free motions
    bool predicted = false;
  };

  /// Applies released conditions first, the rest of the path after them; if that finds no
  /// equilibrium, the reactions fade along the path. @returns whether there is more to do
  bool release(const JobContext& context, const StepCallback& on_step) {
    if (released_.empty()) return true;
    detail::DampedDescent descent(equilibrium_, path_.at(0));
    descent.take_over(released_);
    const LinkageState start = state_;
    const DeploymentReport before = report_;
    const auto end = descend(descent, state_, context, [&](const auto& step) {
      note(step.report, step.jumped ? BranchEvent::kJump : BranchEvent::kNone, step.turned);
      if (on_step) on_step(report_.path.back(), state_);
    });
    if (end == detail::DampedDescent::End::kCancelled) {
      cancel();
      report_.held = descent.held();
      return false;
    }
    if (end == detail::DampedDescent::End::kThere) {
      report_.held = descent.held();
      path_ = detail::ConditionPath(state_, from_, to_, {});
      if (path_.stays()) length_ = 1;
      return true;
    }
    state_ = start;
    path_ =
        detail::ConditionPath(state_, from_, to_, detail::without_pushes(model_, released_, to_));
    const DeploymentReport tried = std::exchange(report_, before);
    report_.iterations = tried.iterations;
    report_.corrections = tried.corrections;
    report_.factorizations = tried.factorizations;
    return true;
  }

  template <class OnStep>
  detail::DampedDescent::End descend(detail::DampedDescent& descent, LinkageState& state,
                                     const JobContext& context, const OnStep& on_step,
                                     const detail::DampedDescent::Allows& allows = {}) {
    EquilibriumOptions options = options_.last;
    options.tolerance = std::max(options.tolerance, kDescentTolerance * options_.step_tolerance);
    return descent.run(
        state, options, context,
        [&](const detail::DampedDescent::Step& step, const LinkageState&) {
          count(step.report);
          on_step(step);
        },
        [&](const EquilibriumReport& report) { count(report); }, allows);
  }

  void cancel() {
    report_.status = DeploymentStatus::kCancelled;
    report_.message = "cancelled by the caller";
  }

  void count(const EquilibriumReport& report) {
    report_.iterations += report.iterations;
    report_.corrections += report.corrections;
    report_.factorizations += report.factorizations;
  }

  Trial attempt(double length, bool last, const JobContext& context) {
    Trial trial{state_, {}, {}, 0, 0, false};
    Eigen::VectorXd guess;
    if (prediction_.possible()) {
      guess = prediction_.over(length);
      trial.predicted = scales_.largest_turn(model_, state_, guess) < options_.last.largest_turn;
    }
    if (trial.predicted) {
      equilibrium_.expect_step(state_, prediction_.straight(length));
      trial.state = state_.moved(model_, guess);
    }
    EquilibriumOptions options = options_.last;
    if (!last) options.tolerance = step_tolerance();
    if (shortenable(length))
      options.max_iterations = std::min(options.max_iterations, options_.patience);
    const Conditions conditions = path_.at(progress_ + length);
    trial.increment = Eigen::VectorXd::Zero(model_.variables().size());
    options.max_escapes = 0;
    solve(conditions, options, context, trial);
    if (trial.report.status == EquilibriumStatus::kSaddle && options_.last.max_escapes > 0) {
      options.max_escapes = options_.last.max_escapes;
      // The search for another branch that is not near starts as far along this one as it goes.
      const bool near_only = shortenable(length) && !locates_loss(length);
      options.max_iterations =
          std::min(options_.last.max_iterations, near_only ? kNearBranch : kFarBranch);
      solve(conditions, options, context, trial);
    }
    trial.error = trial.beside = scales_.largest_turn(model_, state_, trial.increment);
    if (trial.report.escapes > 0) {
      Eigen::VectorXd held = trial.increment;
      FreeMotions(model_, conditions, trial.state).remove_from(held);
      trial.beside = scales_.largest_turn(model_, state_, held);
    }
    if (trial.predicted) trial.increment += guess;
    return trial;
  }

  /// Forces that are left turn eigenvalues of a tangent that is not symmetric by much more than
  /// their size: under moments all steps are as fine as the last one.
  [[nodiscard]] double step_tolerance() const {
    const auto has_moment = [](const JointLoad& load) { return !load.moment.isZero(0); };
    const bool is_fine = std::any_of(from_.loads.begin(), from_.loads.end(), has_moment) ||
                         std::any_of(to_.loads.begin(), to_.loads.end(), has_moment);
    return is_fine ? options_.last.tolerance
                   : std::max(options_.last.tolerance, options_.step_tolerance);
  }

  /// To the branch that is below where this one is lost.
  Trial fall(double length, bool last, const Trial& lost, const JobContext& context) {
    Trial trial{state_, lost.report, Eigen::VectorXd::Zero(model_.variables().size()), 0, 0, false};
    const Conditions conditions = path_.at(progress_ + length);
    detail::DampedDescent descent(equilibrium_, conditions);
    // A load that winds a joint up does so without end: it has no equilibrium that counts.
    const auto end = descend(
        descent, trial.state, context,
        [&](const auto& step) { trial.report.iterations += step.report.iterations; },
        [&](const LinkageState& state) { return !overturned(model_, start_, state); });
    if (end == detail::DampedDescent::End::kForbidden) return trial;
    trial.increment = descent.increment();
    trial.report.status = EquilibriumStatus::kCancelled;
    if (end == detail::DampedDescent::End::kCancelled) return trial;
    EquilibriumOptions options = options_.last;
    if (!last) options.tolerance = step_tolerance();
    solve(conditions, options, context, trial);
    trial.report.escapes = std::max(1, trial.report.escapes);
    trial.error = trial.beside = scales_.largest_turn(model_, state_, trial.increment);
    return trial;
  }

  /// On from the trial's state.
  void solve(const Conditions& conditions, const EquilibriumOptions& options,
             const JobContext& context, Trial& trial) {
    const EquilibriumReport before = trial.report;
    trial.report = equilibrium_.solve(trial.state, conditions, options, context);
    trial.increment += equilibrium_.last_increment();
    count(trial.report);
    trial.report.iterations += before.iterations;
    trial.report.corrections += before.corrections;
    trial.report.factorizations += before.factorizations;
    trial.report.escapes += before.escapes;
  }

  /// Approaches the place where the branch was lost, by halves of the distance until it is near.
  void approach_loss() {
    const double left = lost_at_ - progress_;
    if (left < options_.smallest_step) {
      lost_at_ = kNoProgress;
    } else {
      length_ = std::min(length_, locates_loss(left) ? left : left / 2);
    }
  }

  /// Is a step short enough to tell where a branch is lost?
  [[nodiscard]] bool locates_loss(double length) const {
    return length < 1.5 / kLostSteps * options_.largest_step;
  }

  [[nodiscard]] bool shortenable(double length) const {
    return length > 1.5 * options_.smallest_step;
  }

  /// A branch whose stability is lost has ended, however short the step: a few tries tell whether
  /// it continued for a while.
  [[nodiscard]] bool worth_retrying(const Trial& trial, double length) const {
    const bool lost = trial.report.escapes > 0;
    return shortenable(length) && !(lost && locates_loss(length));
  }

  void shorten() {
    ++report_.steps_shortened;
    length_ /= 2;
  }

  /// Excessive requests make a linkage jump between branches, or stop its progress.
  [[nodiscard]] bool too_much() {
    const int ends = report_.branchings + report_.limit_points + report_.jumps;
    const int iterations = report_.iterations - tenth_iterations_;
    std::string reason;
    if (ends >= options_.most_ends) {
      reason = fmt::format("the structure has snapped or buckled {} (limit {})",
                           ends == 1 ? "once" : fmt::format("{} times", ends), options_.most_ends);
    } else if (iterations >= options_.most_iterations) {
      reason = fmt::format("{} steps of the solver advanced it only from {:.4g} % to {:.4g} %",
                           iterations, 100 * tenth_, 100 * progress_);
    } else {
      return false;
    }
    report_.end.status = EquilibriumStatus::kStalled;
    report_.end.message =
        reason +
        ", so the request exceeds what this structure can reach: request less, or edit in stages";
    stop();
    return true;
  }

  void stop() {
    ++report_.steps_failed;
    report_.status = DeploymentStatus::kStopped;
    report_.message = fmt::format("stopped at {:.4g} % of the requested change: {}",
                                  100 * progress_, report_.end.message);
    report_.resistance = detail::greatest_resistance(equilibrium_, state_, path_.at(progress_));
  }

  /// One step, shorter if need be. @returns whether there is a next one
  bool advance(const JobContext& context) {
    if (too_much()) return false;
    approach_loss();
    for (;;) {
      const bool last = progress_ + length_ > 1 - 1e-9;
      if (last) length_ = 1 - progress_;
      Trial trial = attempt(length_, last, context);
      if (trial.report.status == EquilibriumStatus::kCancelled) {
        cancel();
        return false;
      }
      bool jumped = trial.error > options_.jump_turn;
      std::optional<int> over = overturned(model_, start_, trial.state);
      const bool lost = jumped || over || !trial.report.converged();
      if (lost && worth_retrying(trial, length_)) {
        if (trial.report.escapes > 0) lost_at_ = progress_ + length_;
        shorten();
        continue;
      }
      if (!trial.report.converged()) {
        trial = fall(length_, last, trial, context);
        if (trial.report.status == EquilibriumStatus::kCancelled) {
          cancel();
          return false;
        }
        // If two directions are nearly without resistance, a step of another length may succeed.
        if (trial.report.status == EquilibriumStatus::kIterationLimit && shortenable(length_)) {
          shorten();
          continue;
        }
        jumped = trial.error > options_.jump_turn;
        over = overturned(model_, start_, trial.state);
      }
      report_.end = trial.report;
      if (over) {
        report_.end.status = EquilibriumStatus::kStalled;
        report_.end.message = fmt::format(
            "joint {} would turn over, to an opening angle of {:.0f} degrees: request "
            "less, or set the angle of that joint",
            *over,
            std::remainder(trial.state.joints()[*over].opening_angle * kDegreesPerRadian, 360.0));
      }
      if (!report_.end.converged()) {
        stop();
        return false;
      }
      accept(std::move(trial), jumped, last);
      return true;
    }
  }

  void accept(Trial trial, bool jumped, bool last) {
    const EquilibriumReport& found = trial.report;
    BranchEvent event = BranchEvent::kNone;
    if (jumped) {
      event = ended() ? BranchEvent::kLimitPoint : BranchEvent::kJump;
    } else if (found.escapes > 0 && !(trial.predicted && trial.beside < kBeside)) {
      event = BranchEvent::kBranching;
    }
    progress_ = last ? 1 : progress_ + length_;
    if (progress_ >= tenth_ + 0.1) {
      tenth_ = progress_;
      tenth_iterations_ = report_.iterations;
    }
    state_ = std::move(trial.state);
    note(found, event, trial.error);
    if (event != BranchEvent::kNone) {
      prediction_.clear();
      last_step_.resize(0);
    } else {
      add_prediction(trial.increment);
      last_step_ = std::move(trial.increment);
    }
    if (found.iterations <= options_.patience / 6)
      length_ = std::min(2 * length_, options_.largest_step);
  }

  void note(const EquilibriumReport& found, BranchEvent event, double error) {
    DeploymentStep step;
    step.event = event;
    step.progress = progress_;
    step.mean_opening_angle = state_.mean_opening_angle();
    step.energy = found.energies.total();
    step.iterations = found.iterations;
    step.negative_eigenvalues = found.negative_eigenvalues;
    step.prediction_error = error;
    report_.path.push_back(step);
    report_.reached = found;
    ++report_.steps;
    if (event == BranchEvent::kBranching) ++report_.branchings;
    if (event == BranchEvent::kLimitPoint) ++report_.limit_points;
    if (event == BranchEvent::kJump) ++report_.jumps;
  }

  void add_prediction(Eigen::VectorXd increment) {
    if (progress_ >= 1) return;
    const double ahead = kAhead * length_;
    LinkageEquilibrium::Motion motion =
        equilibrium_.motion(state_, path_.at(progress_), path_.at(progress_ + ahead));
    const FreeMotions free(model_, path_.at(progress_), state_);
    free.remove_from(increment);
    free.remove_from(motion.left);
    free.remove_from(motion.ahead);
    prediction_.add(length_, increment, std::move(motion.left), motion.ahead / ahead);
  }

  /// Did the branch end here? Towards a limit point the path turns into the direction that nothing
  /// resists any more, along which it turns back; elsewhere it keeps out of it (Keller 1977).
  [[nodiscard]] bool ended() {
    if (last_step_.size() == 0) return false;
    const Eigen::VectorXd& weights = scales_.weights();
    const Eigen::VectorXd soft = equilibrium_.softest_direction(state_, path_.at(progress_));
    const double along = last_step_.dot(weights.cwiseProduct(soft));
    return along * along > kAlongSoftest * last_step_.dot(weights.cwiseProduct(last_step_)) *
                               soft.dot(weights.cwiseProduct(soft));
  }

  LinkageEquilibrium& equilibrium_;
  const LinkageModel& model_;
  detail::UnknownScales scales_;
  LinkageState& state_;
  const Conditions from_;
  std::vector<JointLoad> released_;
  detail::ConditionPath path_;
  const LinkageState start_;
  const Conditions& to_;
  const DeploymentOptions& options_;
  detail::Prediction prediction_{kPlaces};
  Eigen::VectorXd last_step_;  // the last step's, unless it was an event
  double progress_ = 0;
  double tenth_ = 0;  // where the last tenth of the path ended
  int tenth_iterations_ = 0;
  double length_;
  double lost_at_ = kNoProgress;  // progress at which a longer step found the branch lost
  DeploymentReport report_;
};

}  // namespace

std::optional<int> overturned(const LinkageModel& model, const LinkageState& from,
                              const LinkageState& to) {
  constexpr double kSameAngle = 1e-3;  // difference that counts as none [rad]
  for (std::size_t j = 0; j < to.joints().size(); ++j) {
    const double angle = std::abs(to.joints()[j].opening_angle);
    if (angle > largest_opening(model.graph(), j) &&
        angle > std::abs(from.joints()[j].opening_angle) + kSameAngle)
      return static_cast<int>(j);
  }
  return std::nullopt;
}

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
  if (most_ends <= 0) {
    throw Error(ErrorCode::kInvalidArgument, "most_ends",
                fmt::format("most_ends must be > 0, got {}", most_ends));
  }
  if (most_iterations <= 0) {
    throw Error(ErrorCode::kInvalidArgument, "most_iterations",
                fmt::format("most_iterations must be > 0, got {}", most_iterations));
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
