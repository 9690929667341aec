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

void follow_path(const BeamStructure& structure, const LoadPath& path, double s,
                 const BeamSolveOptions& options, const JobContext& context,
                 const BeamObserver& observer, BeamState& state, BeamReport& report) {
  NewtonSolver newton(structure, options, context);
  double step = path.varies() ? options.first_load_step * (1 - s) : 1 - s;
  // Attitudes are told apart by less than half a turn.
  const double longest = kMostTurn / std::max(kMostTurn, path.turn());
  step = std::min(step, longest);
  BeamStatus status = BeamStatus::kStalled;
  int unknown = -1;
  if (path.nudged() && s == 0) {
    // Temporary loads bend what is straight before motions press on it.
    newton.balance(state, path, 0, kOnTheWay, kIterationsOfStep);
    if (observer) observer({&state, 0, newton.left().scaled, 0});
  }
  for (;;) {
    const double next = s + step > 1 - 1e-9 ? 1 : s + step;
    BeamState trial = state;
    const int left = options.newton_iterations - newton.iterations();
    const int before = newton.iterations();
    const NewtonOutcome outcome =
        newton.balance(trial, path, next, next < 1 ? kOnTheWay : options.tolerance,
                       std::min(left, next < 1 || step > kSmallestStep ? kIterationsOfStep : left));
    unknown = newton.left().unknown;
    const bool done = outcome == NewtonOutcome::kBalanced || outcome == NewtonOutcome::kMechanism;
    report.newton_iterations = newton.iterations();
    report.factorizations = newton.factorizations();
    if (done) {
      state = std::move(trial);
      s = next;
      ++report.load_steps;
      report.load_factor = s;
      report.residual = newton.left().scaled;
      if (observer) observer({&state, s, report.residual, report.load_steps});
      if (outcome == NewtonOutcome::kMechanism && s >= 1) {
        status = BeamStatus::kMechanism;
        unknown = newton.softest(state).unknown;
        break;
      }
      if (s >= 1) {
        status = BeamStatus::kConverged;
        break;
      }
      if (newton.iterations() - before <= kEasy) step *= 2;
      step = std::min({step, 1 - s, longest});
      context.report("load steps", s);
      continue;
    }
    if (newton.iterations() >= options.newton_iterations) {
      status = BeamStatus::kIterationLimit;
      break;
    }
    step *= outcome == NewtonOutcome::kTooFar ? 0.5 : 0.25;
    if (step < kSmallestStep) {
      report.residual = newton.left().scaled;
      const auto soft = newton.softest(structure.rest_state());
      if (newton.vanishes(soft.eigenvalue)) {
        status = BeamStatus::kMechanism;
        unknown = soft.unknown;
      }
      break;
    }
  }
  say(structure, status, unknown, report);
}

void certify(const BeamStructure& structure, const BeamSolveOptions& options,
             const JobContext& context, const BeamState& state, BeamReport& report) {
  NewtonSolver newton(structure, options, context);
  const NewtonSolver::Softest soft = newton.softest(state);
  if (newton.vanishes(soft.eigenvalue)) {
    say(structure, BeamStatus::kMechanism, soft.unknown, report);
  } else if (soft.eigenvalue < 0) {
    say(structure, BeamStatus::kUnstable, soft.unknown, report);
  }
}

}  // namespace limber::beams::detail
