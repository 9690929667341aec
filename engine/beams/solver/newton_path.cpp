#include "engine/beams/solver/newton_path.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "engine/beams/solver/newton.h"
#include "engine/beams/solver/step_watch.h"

namespace limber::beams::detail {

namespace {

constexpr double kSmallestStep = 1e-5;
constexpr double kOnTheWay = 1e-4;  // tolerance of states that are only passed
constexpr int kIterationsOfStep = 60;
constexpr double kMostTurn = 0.6;  // of what is held, in one load step [rad]
constexpr int kEasy = 8;           // iterations
// Where steps are watched: states that are passed are compared with each other, and what such a
// short step does not make small is a snap. Close to a fold, turns go with the root of the step.
constexpr double kOnTheWayWatched = 1e-7;
constexpr double kShortestWatched = 1.0 / 8192;
// Just behind a fold the forces that drive the structure away are too small to get it anywhere:
// leaps over it grow by this, with as many iterations each.
constexpr double kLonger = 8;
constexpr int kIterationsOfLeap = 150;

std::string where(const BeamStructure& structure, int unknown) {
  if (unknown < 0) return "nowhere";
  if (unknown < 6 * structure.nodes())
    return fmt::format("node {} {}", unknown / 6, unknown % 6 < 3 ? "moves" : "turns");
  for (const ReleasedEnd& r : structure.released_ends()) {
    if (unknown >= r.unknown && unknown < r.unknown + r.axes)
      return fmt::format("the {} of element {} turns",
                         r.end == ElementEnd::kStart ? "start" : "finish", r.element);
  }
  return "nowhere";
}

void say(const BeamStructure& structure, BeamStatus status, int unknown, BeamReport& report) {
  report.status = status;
  report.node = Balance(structure).node_of(unknown);
  switch (status) {
    case BeamStatus::kConverged:
      report.message = "forces and moments balance at a minimum";
      break;
    case BeamStatus::kUnstable:
      report.message = "balanced at a saddle: the energy falls where " + where(structure, unknown);
      break;
    case BeamStatus::kMechanism:
      report.message = where(structure, unknown) + " without any resistance";
      break;
    default:
      report.message = fmt::format("residual {:.2g} at load factor {:.6g}, worst where {}",
                                   report.residual, report.load_factor, where(structure, unknown));
  }
}

}  // namespace

namespace {

/// Load steps of one call.
class Follower {
 public:
  Follower(const BeamStructure& structure, const LoadPath& path, double s,
           const BeamSolveOptions& options, BeamState& state, BeamReport& report,
           const JobContext& context)
      : structure_(structure),
        path_(path),
        options_(options),
        state_(state),
        report_(report),
        newton_(structure, context),
        watch_(structure),
        s_(s),
        // Attitudes are told apart by less than half a turn.
        longest_(kMostTurn / std::max(kMostTurn, path.turn())) {
    step_ = path.varies() ? options.first_load_step * (1 - s) : 1 - s;
    step_ = std::min(step_, longest_);
  }

  /// Temporary loads bend what is straight before motions press on it.
  void nudge(const BeamObserver& observer) {
    if (!path_.nudged() || s_ > 0) return;
    newton_.balance(state_, path_, 0, kOnTheWay, kIterationsOfStep);
    if (observer) observer({&state_, 0, newton_.left().scaled, 0});
  }

  /// One load step. @returns whether to go on
  bool advance(const JobContext& context, const BeamObserver& observer) {
    const double next = s_ + step_ > 1 - 1e-9 ? 1 : s_ + step_;
    BeamState trial = state_;
    const int before = newton_.iterations();
    const int left = options_.newton_iterations - before;
    const NewtonOutcome outcome = newton_.balance(
        trial, path_, next, next < 1 ? on_the_way() : options_.tolerance,
        s_ < 1 ? std::min(left, leap_ > 0 ? kIterationsOfLeap : kIterationsOfStep) : left);
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
    if (outcome != NewtonOutcome::kBalanced && outcome != NewtonOutcome::kMechanism)
      return shorten(outcome);
    if (is_watched() && !watch(trial, next)) return true;
    state_ = std::move(trial);
    s_ = next;
    ++report_.load_steps;
    report_.load_factor = s_;
    report_.residual = newton_.left().scaled;
    if (observer) observer({&state_, s_, report_.residual, report_.load_steps});
    if (s_ >= 1) {
      const bool loose = outcome == NewtonOutcome::kMechanism;
      say(structure_, loose ? BeamStatus::kMechanism : BeamStatus::kConverged,
          loose ? newton_.softest(state_).unknown : -1, report_);
      return false;
    }
    const bool easy = newton_.iterations() - before <= kEasy;
    step_ *= std::min(easy ? 2.0 : 1.0, room_);
    step_ = std::min({step_, 1 - s_, longest_});
    context.report("load steps", s_);
    return true;
  }

 private:
  [[nodiscard]] bool is_watched() const { return options_.largest_swerve > 0; }
  [[nodiscard]] double on_the_way() const { return is_watched() ? kOnTheWayWatched : kOnTheWay; }

  /// Swerves go with the square of the step on a branch, and stay what they are where it is left.
  /// @returns false: once more, with a shorter step
  bool watch(const BeamState& trial, double next) {
    const double step = next - s_;
    const StepWatch::Verdict seen = watch_.look(state_, trial, step);
    const double wanted = std::sqrt(0.5 * options_.largest_swerve / std::max(seen.swerve, 1e-12));
    room_ = std::clamp(wanted, 0.5, 2.0);
    if (seen.swerve <= options_.largest_swerve) {
      leap_ = 0;
      watch_.take(state_, trial, step);
      return true;
    }
    if (step > kShortestWatched && leap_ == 0) {
      step_ = step * std::clamp(wanted, 0.1, 0.5);
      return false;
    }
    report_.snaps.push_back({next, seen.turn, seen.node});
    watch_.forget();
    leap_ = 0;
    room_ = 2;
    return true;
  }

  /// @returns whether there is another one
  bool leap() {
    leap_ = leap_ == 0 ? kLonger * kShortestWatched : kLonger * leap_;
    step_ = std::min(leap_, 1 - s_);
    return leap_ < kLonger;
  }

  bool shorten(NewtonOutcome outcome) {
    const int unknown = newton_.left().unknown;
    step_ *= outcome == NewtonOutcome::kTooFar ? 0.5 : 0.25;
    const bool is_short = leap_ > 0 || step_ < kShortestWatched;
    if (is_watched() && is_short && newton_.iterations() < options_.newton_iterations && leap())
      return true;
    if (newton_.iterations() < options_.newton_iterations && step_ >= kSmallestStep) return true;
    report_.residual = newton_.left().scaled;
    if (newton_.iterations() >= options_.newton_iterations) {
      say(structure_, BeamStatus::kIterationLimit, unknown, report_);
      return false;
    }
    const auto soft = newton_.softest(structure_.rest_state());
    const bool loose = newton_.vanishes(soft.eigenvalue);
    say(structure_, loose ? BeamStatus::kMechanism : BeamStatus::kStalled,
        loose ? soft.unknown : unknown, report_);
    return false;
  }

  const BeamStructure& structure_;
  const LoadPath& path_;
  const BeamSolveOptions& options_;
  BeamState& state_;
  BeamReport& report_;
  NewtonSolver newton_;
  StepWatch watch_;
  double room_ = 2;  // by which the next step may grow
  double leap_ = 0;  // over a fold, as a share of the way; 0: not at one
  double s_;
  double step_ = 1;
  double longest_;
};

}  // namespace

void follow_path(const BeamStructure& structure, const LoadPath& path, double s,
                 const BeamSolveOptions& options, const JobContext& context,
                 const BeamObserver& observer, BeamState& state, BeamReport& report) {
  Follower follower(structure, path, s, options, state, report, context);
  follower.nudge(observer);
  while (follower.advance(context, observer)) {
  }
}

void certify(const BeamStructure& structure, const JobContext& context, const BeamState& state,
             BeamReport& report) {
  NewtonSolver newton(structure, context);
  const NewtonSolver::Softest soft = newton.softest(state);
  if (newton.vanishes(soft.eigenvalue)) {
    say(structure, BeamStatus::kMechanism, soft.unknown, report);
  } else if (soft.eigenvalue < 0) {
    say(structure, BeamStatus::kUnstable, soft.unknown, report);
  }
}

}  // namespace limber::beams::detail
