#include "engine/beams/solver/newton_path.h"

#include <fmt/core.h>

#include <algorithm>

#include "engine/beams/solver/newton.h"

namespace limber::beams::detail {

namespace {

constexpr double kSmallestStep = 1e-5;
constexpr double kOnTheWay = 1e-4;  // tolerance of states that are only passed
constexpr int kIterationsOfStep = 60;
constexpr double kMostTurn = 0.6;  // of what is held, in one load step [rad]
constexpr int kEasy = 8;           // iterations

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
    const NewtonOutcome outcome =
        newton_.balance(trial, path_, next, next < 1 ? kOnTheWay : options_.tolerance,
                        s_ < 1 ? std::min(left, kIterationsOfStep) : left);
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
    if (outcome != NewtonOutcome::kBalanced && outcome != NewtonOutcome::kMechanism)
      return shorten(outcome);
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
    if (newton_.iterations() - before <= kEasy) step_ *= 2;
    step_ = std::min({step_, 1 - s_, longest_});
    context.report("load steps", s_);
    return true;
  }

 private:
  bool shorten(NewtonOutcome outcome) {
    const int unknown = newton_.left().unknown;
    step_ *= outcome == NewtonOutcome::kTooFar ? 0.5 : 0.25;
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
