#include "engine/beams/solver/equilibrium.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "engine/base/start_shift.h"
#include "engine/beams/solver/buckling_estimate.h"
#include "engine/beams/solver/certificate.h"
#include "engine/beams/solver/finite_state.h"
#include "engine/beams/solver/following_tangent.h"
#include "engine/beams/solver/newton.h"
#include "engine/beams/solver/newton_path.h"
#include "engine/beams/solver/relaxation_path.h"
#include "engine/beams/solver/reversal.h"
#include "engine/beams/solver/shorter_elements.h"
#include "engine/beams/solver/step_watch.h"
#include "engine/beams/solver/uncertain_element.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams {

namespace {

// Newton's method that brings the start into balance without loads.
constexpr double kToleranceOfStart = 1e-7;  // residual
constexpr int kIterationsOfStart = 60;

void add_work(const BeamReport& of, BeamReport& to) {
  to.newton_iterations += of.newton_iterations;
  to.factorizations += of.factorizations;
  to.relaxation_steps += of.relaxation_steps;
}

/// As other processors' last digits might have it: see start_shift().
BeamState begun(const BeamStructure& structure, const BeamState& start) {
  Eigen::VectorXd moves = start_moves(structure.unknowns());
  if (moves.size() == 0) return start;
  const double extent =
      (start.positions.rowwise().maxCoeff() - start.positions.rowwise().minCoeff()).maxCoeff();
  for (Eigen::Index unknown = 0; unknown < moves.size(); ++unknown) {
    if (structure.held()[static_cast<std::size_t>(unknown)])
      moves[unknown] = 0;
    else if (unknown < 6 * structure.nodes() && unknown % 6 < 3)
      moves[unknown] *= extent;
  }
  return structure.moved(start, moves);
}

/// One attempt from `start`.
struct Attempt {
  const BeamStructure& structure;
  const BeamState& start;
  const detail::LoadPath& path;
  const BeamSolveOptions& options;
  const JobContext& context;
  const BeamObserver& observer;

  void newton(BeamSolution& solution) const {
    solution.state = start;
    solution.report.method = BeamMethod::kNewton;
    detail::follow_path(structure, path, 0, options, context, observer, solution.state,
                        solution.report);
    if (!solution.report.converged() && options.method == BeamMethod::kNewton &&
        path.loads(1).follows())
      solution.report.message +=
          "; loads that follow have no potential for load steps to lower: try a relaxation";
  }

  void relaxation(BeamSolution& solution) const {
    solution.state = start;
    solution.report.method = BeamMethod::kRelaxation;
    detail::relax(structure, path, options.relaxation_tolerance, options, context, observer,
                  solution.state, solution.report);
    if (solution.report.converged())
      detail::certify(structure, context, path.loads(1), solution.state, solution.report);
  }

  void both(BeamSolution& solution) const {
    solution.state = start;
    BeamReport& report = solution.report;
    report.method = BeamMethod::kRelaxationThenNewton;
    detail::relax(structure, path, options.hand_over, options, context, observer, solution.state,
                  report);
    if (report.status == BeamStatus::kStalled && settled(solution)) return;
    if (!report.converged()) return;
    if (const NodeLoads loads = path.loads(1); loads.follows())
      following(loads, solution);
    else
      detail::follow_path(structure, path, 1, options, context, observer, solution.state, report);
  }

  /// Cables that go slack and taut may keep the dynamics from settling close to balance: does
  /// Newton's method find it from there?
  bool settled(BeamSolution& solution) const {
    if (path.loads(1).follows()) return false;
    BeamSolution other = solution;
    detail::follow_path(structure, path, 1, options, context, observer, other.state, other.report);
    if (!other.report.converged()) return false;
    solution = std::move(other);
    return true;
  }

  /// Loads that follow have no potential that Newton's method could lower: it finishes on forces.
  void following(const NodeLoads& loads, BeamSolution& solution) const {
    BeamReport& report = solution.report;
    if (!detail::balance_following(structure, loads, options.tolerance, context, solution.state,
                                   report)) {
      const BeamReport before = report;
      report = {};
      relaxation(solution);
      add_work(before, report);
      return;
    }
    report.message = "forces and moments balance";
    detail::certify(structure, context, loads, solution.state, report);
  }

  /// Those that follow a branch.
  [[nodiscard]] BeamSolveOptions careful_options() const {
    BeamSolveOptions careful = options;
    const BeamSolveOptions following = BeamSolveOptions::following();
    if (careful.largest_swerve == 0) careful.largest_swerve = following.largest_swerve;
    if (careful.newton_iterations == BeamSolveOptions{}.newton_iterations)
      careful.newton_iterations = following.newton_iterations;
    return careful;
  }

  /// By Newton's method with temporary loads on to the end, in steps so small that the branch they
  /// lead to is not lost; then they fade. The relaxation's ramp is quicker than a push at one node
  /// spreads over the structure, and long load steps jump: both may end on the other side. Motion
  /// of the whole structure is independent of that, and comes first.
  void pushed(BeamSolution& solution) const {
    const BeamSolveOptions careful = careful_options();
    solution.state = start;
    solution.state.positions.colwise() += path.common_move();
    BeamReport& report = solution.report;
    report.method = BeamMethod::kNewton;
    detail::follow_path(structure, path.pushed(), 0, careful, context, observer, solution.state,
                        report);
    if (!report.converged()) return;
    const BeamReport on = report;
    report = {};
    report.method = BeamMethod::kNewton;
    detail::follow_path(structure, path.release(), 0, careful, context, observer, solution.state,
                        report);
    report.newton_iterations += on.newton_iterations;
    report.factorizations += on.factorizations;
    report.relaxation_steps += on.relaxation_steps;
    report.load_steps += on.load_steps;
    for (BeamSnap& snap : report.snaps) snap.load_factor = 1;  // loads and motions are on
    report.snaps.insert(report.snaps.begin(), on.snaps.begin(), on.snaps.end());
    if (options.largest_swerve == 0) report.snaps.clear();
    report.equilibrium_share.reset();  // of the loads: they are on while the push fades
  }

  [[nodiscard]] bool is_folded(const BeamState& state) const {
    const auto uncertain = detail::find_uncertain_element(structure, state);
    return uncertain && uncertain->hopeless;
  }

  /// Against the push, or with elements folded by a load step that was too long.
  [[nodiscard]] bool went_astray(const BeamSolution& solution) const {
    // Folded elements hide resistances below the rounding of their forces.
    const bool is_loose =
        solution.report.status == BeamStatus::kMechanism && solution.report.load_factor == 1;
    if (!path.nudged() || !(solution.report.converged() || is_loose)) return false;
    if (is_folded(solution.state)) return true;
    return !is_loose && path.nudge_work(start, solution.state) < 0;
  }

  /// Temporary loads choose the side.
  void keep_to_the_side(BeamSolution& solution) const {
    if (!went_astray(solution)) return;
    if (options.method == BeamMethod::kChoose || options.method == BeamMethod::kNewton) {
      BeamSolution other;
      pushed(other);
      if (other.report.converged()) {
        add_work(solution.report, other.report);
        solution = std::move(other);
      }
    }
    if (solution.report.converged() && path.nudge_work(start, solution.state) < 0)
      solution.report.message += "; it rests on the other side than temporary loads push to";
  }

  /// In steps so short that the branch is kept, and its end is reported.
  void followed(BeamSolution& solution) const {
    const BeamSolveOptions careful = careful_options();
    Attempt{structure, start, path, careful, context, observer}.newton(solution);
  }

  /// Converged, and not with elements folded by a load step that was too long.
  [[nodiscard]] bool is_found(const BeamSolution& solution) const {
    if (solution.report.status == BeamStatus::kMechanism) return solution.report.load_factor == 1;
    if (!solution.report.converged()) return false;
    return !is_folded(solution.state);
  }

  /// A relaxation may fold elements where a column buckles under its whole load: then by load steps
  /// from the start.
  void both_or_newton(BeamSolution& solution) const {
    both(solution);
    const NodeLoads loads = path.loads(1);
    if (is_found(solution) || loads.follows() || path.nudged()) return;
    BeamSolution other;
    newton(other);
    if (!is_found(other)) {
      add_work(other.report, solution.report);
      return;
    }
    add_work(solution.report, other.report);
    solution = std::move(other);
    solution.report.message += "; found by load steps: the relaxation led to no equilibrium";
  }

  /// Long load steps may end on another branch, and say nothing: Newton's method follows the one
  /// that begins where the structure was drawn. If temporary loads choose among many buckling
  /// modes, it loses its time at saddles that the relaxation never sees (limber-bench beams).
  void chosen(BeamSolution& solution) const {
    const bool relaxes_first = path.nudged() && options.largest_swerve == 0;
    if (relaxes_first)
      both(solution);
    else
      path.varies() ? followed(solution) : newton(solution);
    if (is_found(solution)) return;
    const BeamSolution branch = solution;
    const BeamStatus status = branch.report.status;
    const double end_of_branch = branch.report.load_factor;
    const std::optional<double> share = branch.report.equilibrium_share;
    BeamSolution other;
    relaxes_first ? newton(other) : both(other);
    add_work(solution.report, other.report);
    // A saddle says more than that no balance was found.
    const BeamStatus found = other.report.status;
    const bool is_other = is_found(other);
    if (!is_other && (found != BeamStatus::kUnstable || status == BeamStatus::kUnstable)) {
      solution.report.relaxation_steps = other.report.relaxation_steps;
      return;
    }
    solution = std::move(other);
    if (relaxes_first) return;
    solution.report.equilibrium_share = share;
    if (!is_other) {
      solution.report.load_factor = end_of_branch;
    } else if (end_of_branch < 1) {
      record_jump(branch, solution);
      solution.report.message += fmt::format(
          "; found by relaxation: the equilibria that lead on from the start were followed to "
          "{:.3g} %",
          100 * end_of_branch);
    }
  }

  /// A relaxation, and a push that is taken away, do not notice a jump: an answer from which the
  /// structure does not return to its start is on another branch.
  void look_for_jump(BeamSolution& solution) const {
    using Outcome = detail::NewtonOutcome;
    const bool is_followed = options.method == BeamMethod::kNewton ||
                             (options.method == BeamMethod::kChoose && !path.nudged());
    if (is_followed || !solution.report.converged() || !solution.report.snaps.empty()) return;
    const detail::LoadPath plain = path.without_temporary_loads();
    if (!plain.varies() || plain.loads(1).follows()) return;
    detail::NewtonSolver newton(structure, context);
    BeamState first = start;
    const Outcome outcome = newton.balance(first, plain, 0, kToleranceOfStart, kIterationsOfStart);
    // If the start balances nothing, no branch leads on from it.
    if (outcome != Outcome::kBalanced && outcome != Outcome::kMechanism) return;
    if (detail::reverses(structure, plain, newton, {first, 0}, {solution.state, 1})) return;
    const detail::Turn turn = detail::turn_between(structure, first, solution.state);
    solution.report.snaps.push_back({1, turn.angle, turn.node});
  }

  /// An answer from which the structure does not return to the end of the branch is on another one.
  void record_jump(const BeamSolution& branch, BeamSolution& answer) const {
    const double s = branch.report.load_factor;
    answer.report.snaps = branch.report.snaps;
    detail::NewtonSolver newton(structure, context);
    if (detail::reverses(structure, path, newton, {branch.state, s}, {answer.state, 1})) return;
    const detail::Turn turn = detail::turn_between(structure, branch.state, answer.state);
    answer.report.snaps.push_back({s, turn.angle, turn.node});
  }
};

/// A node that is held about one axis and has swung by half a turn across it.
void mention_half_swings(const BeamStructure& structure, const BeamState& state,
                         BeamReport& report) {
  for (int i = 0; i < structure.nodes(); ++i) {
    if (!structure.has_swung_by_half_a_turn(state, i)) continue;
    report.message += fmt::format(
        "; {} has swung by half a turn across the axis about which it is held: there it takes no "
        "torque about that axis, and a motion about it does not turn it",
        node_name(structure.model(), i));
  }
}

void explain_failure(const Attempt& attempt, BeamReport& report) {
  try {
    detail::explain_failure(attempt.structure, attempt.start, attempt.path, attempt.context,
                            report);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
  }
}

/// Are elements too long for the equilibrium that was found?
void doubt_elements(const Attempt& attempt, BeamSolution& solution) {
  BeamReport& report = solution.report;
  if (!report.converged()) return;
  const auto uncertain = detail::find_uncertain_element(attempt.structure, solution.state);
  if (!uncertain) return;
  if (!uncertain->hopeless) {
    report.message += "; " + uncertain->message;
    return;
  }
  const std::size_t element = static_cast<std::size_t>(uncertain->element);
  report.status = BeamStatus::kUnstable;
  report.node = attempt.structure.model().elements[element].start;
  report.message = fmt::format("balanced{}, but {}", report.equilibrium_share ? " at 100 %" : "",
                               uncertain->message);
  report.negative_eigenvalues.reset();  // elements so few cannot tell
  report.is_unresolved = true;
}

BeamSolution solve(const Attempt& attempt) {
  attempt.options.validate();
  BeamSolution solution{attempt.start, {}};
  try {
    switch (attempt.options.method) {
      case BeamMethod::kRelaxation:
        attempt.relaxation(solution);
        break;
      case BeamMethod::kRelaxationThenNewton:
        attempt.both_or_newton(solution);
        break;
      case BeamMethod::kNewton:
        attempt.newton(solution);
        break;
      case BeamMethod::kChoose: {
        const BeamSolveOptions bounded =
            attempt.options.bounded_by_size(attempt.structure.elements());
        Attempt{attempt.structure, attempt.start,   attempt.path,
                bounded,           attempt.context, attempt.observer}
            .chosen(solution);
        break;
      }
    }
    attempt.keep_to_the_side(solution);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
    solution.report.status = BeamStatus::kCancelled;
    solution.report.message = "cancelled";
  }
  if (!detail::is_finite(solution.state)) {
    solution.state = attempt.start;
    solution.report.status = BeamStatus::kUnstable;
    solution.report.message = "the solve diverged: positions are no longer finite";
  }
  try {  // a balanced state stays so
    attempt.look_for_jump(solution);
    doubt_elements(attempt, solution);
    if (attempt.options.finer_judgement == FinerJudgement::kAtOnce)
      judge_by_shorter_elements(attempt.structure, solution.state, solution.report,
                                attempt.context);
    detail::resolve(attempt.structure, attempt.context, attempt.path.loads(1), solution.state,
                    attempt.options.tolerance, solution.report);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
  }
  if (solution.report.converged()) solution.report.equilibrium_share = 1;
  mention_half_swings(attempt.structure, solution.state, solution.report);
  explain_failure(attempt, solution.report);
  solution.report.elastic_energy = elastic_energies(attempt.structure, solution.state).total();
  return solution;
}

}  // namespace

void judge_by_shorter_elements(const BeamStructure& structure, const BeamState& state,
                               BeamReport& report, const JobContext& context) {
  using Result = detail::ShorterElements::Result;
  if (!report.converged()) return;
  const auto finer = detail::look_with_shorter_elements(structure, state, context);
  if (!finer || finer->result == Result::kStable) return;
  report.negative_eigenvalues.reset();
  report.unjudged_elements = finer->elements;
  if (finer->result == Result::kNotJudged) {
    report.message += "; " + finer->message;
    return;
  }
  report.status = BeamStatus::kUnstable;
  report.node = finer->node;
  report.message = finer->message;
  report.equilibrium_share.reset();
  report.is_unresolved = true;
}

BeamSolution find_equilibrium(const BeamStructure& structure, const BeamSolveOptions& options,
                              const JobContext& context, const BeamObserver& observer) {
  const BeamState start = begun(structure, structure.rest_state());
  const detail::LoadPath path = detail::LoadPath::from_drawn(structure);
  return solve({structure, start, path, options, context, observer});
}

BeamSolution find_equilibrium_from(const BeamStructure& structure, const BeamState& given,
                                   const BeamSolveOptions& options, const JobContext& context,
                                   const BeamObserver& observer) {
  const BeamState start = begun(structure, given);
  const detail::LoadPath path = detail::LoadPath::at_once(structure, start);
  return solve({structure, start, path, options, context, observer});
}

BeamSolution follow_equilibrium(const BeamStructure& structure, const BeamState& given,
                                const std::vector<HeldTurn>& turned,
                                const BeamSolveOptions& options, const JobContext& context,
                                const BeamObserver& observer, FoundUnder found) {
  const BeamState start = found == FoundUnder::kTheseConditions ? given : begun(structure, given);
  const detail::LoadPath path = detail::LoadPath::following(structure, start, turned);
  return solve({structure, start, path, options, context, observer});
}

}  // namespace limber::beams
