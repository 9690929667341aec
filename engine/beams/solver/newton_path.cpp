#include "engine/beams/solver/newton_path.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/beams/solver/certificate.h"
#include "engine/beams/solver/equilibrium_share.h"
#include "engine/beams/solver/following_tangent.h"
#include "engine/beams/solver/newton.h"
#include "engine/beams/solver/relaxation_path.h"
#include "engine/beams/solver/reversal.h"
#include "engine/beams/solver/step_watch.h"
#include "engine/beams/solver/twist_watch.h"
#include "engine/beams/solver/uncertain_element.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

namespace {

// Steps and other shares are shares of the load path, from 0 (as it was) to 1 (as requested).
// Tolerances are residuals as of Balance. No number here is known to have been tuned, unless a
// comment tells of trials.

constexpr double kSmallestStep = 1e-5;      // below it the path ends as stalled
constexpr double kPassedTolerance = 1e-4;   // of states that are only passed
constexpr int kIterationsOfStep = 60;       // of Newton's method, before a step is shortened
constexpr double kMaxTurnOfLoadStep = 0.6;  // of held nodes, in one load step [rad]
constexpr int kEasy = 8;                    // iterations: the next step may then be twice as long
constexpr double kPassedToleranceWatched = 1e-7;  // of states that are compared with each other
// Just behind a fold the forces that drive the structure away are too small for Newton's method to
// get it anywhere: where steps so short fail again and again, it is relaxed over a step so long.
constexpr double kShortWatched = 1.0 / 64;
constexpr double kShortestFork = 1e-6;  // step at which a fork of branches is taken, not approached
constexpr double kToForks = 0.125;      // factor of steps that approach a fork
constexpr double kLeap = 1.0 / 1024;    // least step over which the structure is relaxed
constexpr int kStepsOfLeap = 50000;     // of that relaxation, at most
constexpr int kIterationsOfWatched = 40;            // as kIterationsOfStep, where steps are watched
constexpr double kMaxJumpDistanceShare = 1.0 / 64;  // distance from which a known jump is taken
constexpr double kAfterJump = 1.0 / 16;             // first step after one
constexpr int kIterationsDown = 50;  // of Newton's method, from the end of a branch down
// Moments of fixed directions have no potential where nodes may turn about several axes: Newton's
// method may circle for ever. If so many steps in a row, each a quarter of the one before, end
// where the stiffness is not positive, there is nothing to fall to.
constexpr int kFailuresOfMoments = 5;
constexpr double kLeastBucklingShare = 1e-7;
constexpr double kBucklingResolution = 0.01;        // of the share at which it buckles
constexpr double kMinShareResolution = 1.0 / 1024;  // of the end of the equilibria

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
        watch_(structure, options.largest_swerve, options.snap_resolution),
        approaches_forks_(is_watched()),
        has_moments_(turns_free_nodes(structure, path.loads(1).moments)),
        share_(s, state),
        s_(s),
        // Attitudes are distinguished by less than half a turn.
        longest_(kMaxTurnOfLoadStep / std::max(kMaxTurnOfLoadStep, path.turn())) {
    step_ = path.varies() ? options.first_load_step * (1 - s) : 1 - s;
    step_ = std::min(step_, longest_);
    newton_.limit_factorizations(options.factorizations);
  }

  /// A path that begins at one of a family of equilibria does not wander along the family: Newton's
  /// method gets its directions before anything is out of balance.
  void begin_in_family() {
    if (s_ < 1 && carries_forces(structure_, state_)) (void)newton_.judge(state_, path_.loads(s_));
  }

  /// Temporary loads bend straight parts before motions press on them.
  void nudge(const BeamObserver& observer) {
    if (!path_.nudged() || s_ > 0) return;
    newton_.balance(state_, path_, 0, kPassedTolerance, kIterationsOfStep);
    if (observer) observer({&state_, 0, newton_.left().scaled, 0});
  }

  /// One load step. @returns whether to continue
  bool advance(const JobContext& context, const BeamObserver& observer) {
    const double next = s_ + step_ > 1 - 1e-9 ? 1 : s_ + step_;
    BeamState trial = state_;
    const int before = newton_.iterations(), saddles = newton_.saddles();
    const bool avoids = is_coarse() && approaches_forks_;
    NewtonOutcome outcome = balance(trial, next, avoids ? Forks::kAvoided : Forks::kIgnored);
    if (is_out_of_work()) return end_out_of_work();
    bool takes_fork = false;
    if (is_fork(trial, next, outcome)) {
      if (step_ > shortest_fork()) {
        if (outcome == NewtonOutcome::kBalanced) {
          const StepWatch::Verdict verdict = watch_.look(state_, trial, next - s_);
          jump_ = step_to(trial, next, outcome, verdict);
        }
        step_ *= kToForks;
        return true;
      }
      if (is_coarse()) return leave_branch(context, observer);
      trial = state_;
      outcome = balance(trial, next, Forks::kTaken);
      takes_fork = true;
    }
    const bool fails = outcome != NewtonOutcome::kBalanced && outcome != NewtonOutcome::kMechanism;
    const bool unstable = newton_.saddles() > saddles || (has_moments_ && !newton_.is_positive());
    if (outcome != NewtonOutcome::kTooFar)
      unstable_failures_ = fails && unstable ? unstable_failures_ + 1 : 0;
    if (fails)
      return is_near_jump() ? jump(context, observer) : shorten(outcome, context, observer);
    Step step = step_to(trial, next, outcome, {});
    const bool has_forked = newton_.has_forked();
    const bool escapes = takes_fork || newton_.saddles() > saddles;
    const bool easy = newton_.iterations() - before <= kEasy;
    const std::size_t snaps = report_.snaps.size();
    if (is_watched() && !watch(step)) return true;
    if (!is_watched() && (escapes || has_forked)) {
      step.verdict = watch_.look(state_, step.state, step.s - s_);
      record_jump(step);
    }
    if (approaches_forks_ && escapes && report_.snaps.size() == snaps) locate_buckling(next);
    approaches_forks_ = is_watched() && !has_forked;
    step_ *= std::min(easy ? 2.0 : 1.0, is_watched() ? watch_.factor() : 2.0);
    return take(std::move(step), context, observer);
  }

  /// Reports up to where there is an equilibrium: not all states that balance are.
  void report_share(const JobContext& context) {
    if (!is_watched()) return;
    if (report_.status == BeamStatus::kCancelled) return;
    if (path_.loads(1).follows()) share_.record(s_, state_, verdict_on(s_, state_, context));
    const double resolution = std::max(options_.snap_resolution, kMinShareResolution);
    report_.equilibrium_share = share_.locate(resolution, [&](double s, BeamState& trial) {
      const NewtonOutcome outcome =
          newton_.balance(trial, path_, s, passed_tolerance(), kIterationsOfWatched);
      return outcome == NewtonOutcome::kBalanced &&
             verdict_on(s, trial, context) == EquilibriumShare::Verdict::kEquilibrium;
    });
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
    if (report_.converged() || *report_.equilibrium_share >= s_) return;
    if (const auto uncertain = find_uncertain_element(structure_, state_);
        uncertain && uncertain->hopeless) {
      report_.is_unresolved = true;
      report_.message += fmt::format("; above {:.3g} % elements do not resolve it: {}",
                                     100 * *report_.equilibrium_share, uncertain->message);
    }
  }

 private:
  /// Verdict on a balanced state whose stiffness is positive definite.
  [[nodiscard]] EquilibriumShare::Verdict verdict_on(double s, const BeamState& state,
                                                     const JobContext& context) const {
    using Verdict = EquilibriumShare::Verdict;
    const auto uncertain = find_uncertain_element(structure_, state);
    if (uncertain && uncertain->hopeless) return Verdict::kNone;
    const NodeLoads loads = path_.loads(s);
    if (!loads.follows()) return Verdict::kEquilibrium;
    const auto diverging = FollowingTangent(structure_).diverging(state, loads, context);
    return diverging == 0 ? Verdict::kEquilibrium : Verdict::kNone;
  }

  void record_share(NewtonOutcome outcome, const JobContext& context) {
    // Under loads that follow it takes longer: of the last step only.
    if (!is_watched() || path_.loads(1).follows()) return;
    share_.record(s_, state_,
                  outcome == NewtonOutcome::kBalanced ? verdict_on(s_, state_, context)
                                                      : EquilibriumShare::Verdict::kNone);
  }

  NewtonOutcome balance(BeamState& trial, double next, Forks forks) {
    const int left = options_.newton_iterations - newton_.iterations();
    const int most = is_watched() ? kIterationsOfWatched : kIterationsOfStep;
    const NewtonOutcome outcome =
        newton_.balance(trial, path_, next, next < 1 ? passed_tolerance() : options_.tolerance,
                        s_ < 1 || has_moments_ ? std::min(left, most) : left, forks);
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
    return outcome;
  }

  /// Did the structure buckle on a step that went where nothing before it led to? A step that long
  /// may choose any side.
  [[nodiscard]] bool is_fork(const BeamState& trial, double next, NewtonOutcome outcome) const {
    if (!approaches_forks_ || !newton_.has_forked() || outcome == NewtonOutcome::kMechanism)
      return false;
    return outcome != NewtonOutcome::kBalanced || watch_.surprises(state_, trial, next - s_);
  }

  /// A state that balances further on.
  struct Step {
    BeamState state;
    double s = 0;
    double residual = 0;
    NewtonOutcome outcome = NewtonOutcome::kBalanced;
    StepWatch::Verdict verdict;
    Eigen::MatrixXd neutral;
  };
  /// Step to the result of the last balance().
  [[nodiscard]] Step step_to(const BeamState& state, double s, NewtonOutcome outcome,
                             const StepWatch::Verdict& verdict) const {
    return {state, s, newton_.left().scaled, outcome, verdict, newton_.neutral()};
  }

  /// @returns whether to continue
  bool take(Step&& step, const JobContext& context, const BeamObserver& observer) {
    state_ = std::move(step.state);
    s_ = step.s;
    failures_ = 0;
    if (jump_ && jump_->s <= s_) jump_.reset();
    ++report_.load_steps;
    report_.load_factor = s_;
    report_.residual = step.residual;
    if (observer) observer({&state_, s_, report_.residual, report_.load_steps});
    record_share(step.outcome, context);
    const ElementTwist twist = most_twisted(structure_, state_);
    if (std::abs(twist.angle) > kMaxTwistRad) return end_twisted(twist);
    if (s_ >= 1) {
      const bool loose = step.outcome == NewtonOutcome::kMechanism;
      report_status(structure_, loose ? BeamStatus::kMechanism : BeamStatus::kConverged,
                    loose ? newton_.judge(state_, path_.loads(1)).unknown : -1, report_);
      if (!loose) report_.negative_eigenvalues = 0;
      if (!loose) report_neutral(structure_, state_, step.neutral, report_);
      if (const NodeLoads loads = path_.loads(1); !loose && (loads.follows() || has_moments_))
        certify(structure_, context, loads, state_, report_);
      return false;
    }
    step_ = std::min({step_, 1 - s_, longest_});
    context.report("load steps", s_);
    return true;
  }

  [[nodiscard]] bool is_watched() const { return options_.largest_swerve > 0; }
  /// Are ends of branches located roughly?
  [[nodiscard]] bool is_coarse() const {
    return is_watched() && options_.snap_resolution > BeamSolveOptions::kFineResolution;
  }
  [[nodiscard]] double shortest_fork() const {
    return is_coarse() ? options_.snap_resolution : kShortestFork;
  }
  [[nodiscard]] double shortest_watched() const {
    return is_coarse() ? options_.snap_resolution : BeamSolveOptions::kFineResolution;
  }
  [[nodiscard]] bool is_out_of_work() const {
    return options_.factorizations > 0 && newton_.factorizations() >= options_.factorizations;
  }
  bool end_out_of_work() {
    report_.status = BeamStatus::kIterationLimit;
    report_.node = -1;
    report_.message = fmt::format(
        "{} factorizations did not suffice to go beyond {:.3g} %: edit in smaller steps",
        newton_.factorizations(), 100 * s_);
    return false;
  }
  [[nodiscard]] double passed_tolerance() const {
    return is_watched() ? kPassedToleranceWatched : kPassedTolerance;
  }

  /// @returns false: once more, with a shorter step
  bool watch(Step& step) {
    const StepWatch::Judgement judgement = watch_.judge(state_, step.state, s_, step.s);
    step.verdict = watch_.verdict();
    if (judgement == StepWatch::Judgement::kTooFar) {
      step_ = (step.s - s_) * watch_.factor();
      jump_ = std::move(step);
      return false;
    }
    if (judgement == StepWatch::Judgement::kJump) record_jump(step);
    return true;
  }

  /// For a step that is no jump and left a saddle: bisects to where the branch ceases to be stable.
  void locate_buckling(double next) {
    if (report_.buckling_share) return;
    BeamState stable = state_;
    double low = s_, high = next;
    // Also at the end: a shorter step may find no saddle at all.
    for (bool is_located = false; !is_located;) {
      if (high < kLeastBucklingShare) return;  // nothing was stable
      is_located = high - low <= kBucklingResolution * high;
      const double share = is_located ? high : 0.5 * (low + high);
      BeamState trial = stable;
      const int saddles = newton_.saddles();
      const NewtonOutcome outcome = newton_.balance(trial, path_, share, passed_tolerance(),
                                                    kIterationsOfWatched, Forks::kAvoided);
      report_.newton_iterations = newton_.iterations();
      report_.factorizations = newton_.factorizations();
      if (newton_.has_forked() || newton_.saddles() > saddles) {
        high = share;
      } else if (outcome != NewtonOutcome::kBalanced || is_located) {
        return;
      } else {
        low = share;
        stable = std::move(trial);
      }
    }
    report_.buckling_share = 0.5 * (low + high);
  }

  /// A step that turned by more than the branch led to, or that was not watched and may have left a
  /// saddle, is a snap unless it reverses. One without length balances the result of a relaxation,
  /// which is no equilibrium.
  void record_jump(const Step& step) {
    if (step.s > s_ && !reverses(structure_, path_, newton_, {state_, s_}, {step.state, step.s}))
      report_.snaps.push_back({step.s, step.verdict.turn, step.verdict.node});
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
  }

  [[nodiscard]] bool is_near_jump() const {
    return jump_ && jump_->s - s_ <= kMaxJumpDistanceShare;
  }
  /// To where the structure is known to go from about here.
  bool jump(const JobContext& context, const BeamObserver& observer) {
    Step step = std::move(*jump_);
    jump_.reset();
    if (step.verdict.swerve > options_.largest_swerve) record_jump(step);
    watch_.forget();
    step_ = kAfterJump;
    return take(std::move(step), context, observer);
  }

  /// Down from where the branch ended, by directions in which the energy decreases. @returns
  /// whether to a minimum
  bool descend() {
    const double next = std::min(1.0, s_ + std::max(options_.snap_resolution, step_));
    BeamState trial = state_;
    const NewtonOutcome outcome =
        newton_.balance(trial, path_, next, next < 1 ? passed_tolerance() : options_.tolerance,
                        kIterationsDown, Forks::kDescended);
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
    if (outcome != NewtonOutcome::kBalanced) return false;
    const StepWatch::Verdict verdict = watch_.look(state_, trial, next - s_);
    jump_ = step_to(trial, next, outcome, verdict);
    return true;
  }

  /// To where the structure goes from the end of its branch, which is near.
  bool leave_branch(const JobContext& context, const BeamObserver& observer) {
    if (may_leap_ && leap(context, observer)) return jump(context, observer);
    if (is_out_of_work()) return end_out_of_work();
    report_.status = BeamStatus::kStalled;
    report_.node = Balance(structure_).node_of(newton_.left().unknown);
    report_.residual = newton_.left().scaled;
    report_.message = fmt::format(
        "the equilibria that lead on from the start end at {:.3g} %, and none was found beyond, "
        "where {}",
        100 * s_, location_text(structure_, newton_.left().unknown));
    return false;
  }

  /// Relaxed at a load that is a little higher. @returns whether that balances
  bool leap(const JobContext& context, const BeamObserver& observer) {
    if (is_coarse() && descend()) return true;
    if (is_out_of_work()) return false;
    may_leap_ = false;
    BeamSolveOptions options = options_;
    options.relaxation_steps = std::min(options.relaxation_steps, kStepsOfLeap);
    const double next = std::min(1.0, s_ + std::max(kLeap, step_));
    BeamState trial = state_;
    BeamReport relaxed;
    relax(
        structure_, path_.resting_at(next), options.hand_over, options, context,
        [&](const BeamProgress& on) {
          if (observer) observer({on.state, s_, on.residual, on.step});
        },
        trial, relaxed);
    report_.relaxation_steps += relaxed.relaxation_steps;
    if (!relaxed.converged()) return false;
    const NewtonOutcome outcome =
        newton_.balance(trial, path_, next, next < 1 ? passed_tolerance() : options_.tolerance,
                        options_.newton_iterations - newton_.iterations());
    report_.newton_iterations = newton_.iterations();
    report_.factorizations = newton_.factorizations();
    if (outcome != NewtonOutcome::kBalanced) return false;
    (void)watch_.judge(state_, trial, s_, next);
    jump_ = step_to(trial, next, outcome, watch_.verdict());
    may_leap_ = true;
    return true;
  }

  /// An element that is turned further would let a turn slip through, and balance with less torque.
  bool end_twisted(const ElementTwist& twist) {
    report_.status = BeamStatus::kUnstable;
    report_.is_unresolved = true;
    report_.node = structure_.model().elements[static_cast<std::size_t>(twist.element)].start;
    report_.message = fmt::format(
        "{} is twisted by {:.2f} rad between its ends at load factor {:.3g}, where a turn "
        "may slip through it: take shorter elements",
        element_name(structure_.model(), twist.element), twist.angle, s_);
    return false;
  }

  /// Any balance further on is a saddle, or the stiffness is not positive there.
  bool end_unstable() {
    const bool at_saddle = newton_.saddles() > 0;
    const int unknown = at_saddle ? newton_.saddle_unknown() : newton_.left().unknown;
    report_.status = BeamStatus::kUnstable;
    report_.node = Balance(structure_).node_of(unknown);
    report_.residual = newton_.left().scaled;
    report_.message = fmt::format("no stable balance was found {} load factor {:.3g}, where {}",
                                  s_ < 1 ? "beyond" : "at", s_, location_text(structure_, unknown));
    report_moments();
    return false;
  }

  void report_moments() {
    if (has_moments_)
      report_.message +=
          "; moments that keep their direction in space have no potential where nodes may turn "
          "about several axes: hold those that lead out of the plane of bending, or use dynamic "
          "relaxation";
  }

  bool shorten(NewtonOutcome outcome, const JobContext& context, const BeamObserver& observer) {
    if (has_moments_ && unstable_failures_ >= kFailuresOfMoments) return end_unstable();
    const int unknown = newton_.left().unknown;
    step_ *= outcome == NewtonOutcome::kTooFar ? 0.5 : 0.25;
    if (outcome != NewtonOutcome::kTooFar) ++failures_;
    const bool stuck = failures_ > 1 && step_ < kShortWatched;
    if (is_watched() && may_leap_ && newton_.iterations() < options_.newton_iterations &&
        (stuck || step_ < shortest_watched()) && leap(context, observer))
      return jump(context, observer);
    if (is_out_of_work()) return end_out_of_work();
    if (newton_.iterations() < options_.newton_iterations && step_ >= kSmallestStep) return true;
    report_.residual = newton_.left().scaled;
    if (newton_.iterations() >= options_.newton_iterations) {
      if (unstable_failures_ > 0) return end_unstable();
      report_status(structure_, BeamStatus::kIterationLimit, unknown, report_);
      report_moments();
      return false;
    }
    const NewtonSolver::Verdict drawn = newton_.judge(structure_.rest_state(), path_.loads(0));
    const bool loose = drawn.stability == NewtonSolver::Stability::kMechanism;
    if (!loose && unstable_failures_ > 0) return end_unstable();
    report_status(structure_, loose ? BeamStatus::kMechanism : BeamStatus::kStalled,
                  loose ? drawn.unknown : unknown, report_);
    if (!loose) report_moments();
    return false;
  }

  const BeamStructure& structure_;
  const LoadPath& path_;
  const BeamSolveOptions& options_;
  BeamState& state_;
  BeamReport& report_;
  NewtonSolver newton_;
  StepWatch watch_;
  std::optional<Step> jump_;   // the last one that went too far
  bool may_leap_ = true;       // none has failed
  int failures_ = 0;           // of the balance, since the last step that was taken
  int unstable_failures_ = 0;  // steps in a row that led to unstable states
  bool approaches_forks_;      // the step before was stable throughout
  const bool has_moments_;     // of fixed direction, on nodes that may turn about several axes
  EquilibriumShare share_;
  double s_;
  double step_ = 1;
  double longest_;
};

}  // namespace

void follow_path(const BeamStructure& structure, const LoadPath& path, double s,
                 const BeamSolveOptions& options, const JobContext& context,
                 const BeamObserver& observer, BeamState& state, BeamReport& report) {
  Follower follower(structure, path, s, options, state, report, context);
  follower.begin_in_family();
  follower.nudge(observer);
  while (follower.advance(context, observer)) {
  }
  if (s < 1) follower.report_share(context);
  if (report.converged() && report.buckling_share)
    report.message +=
        fmt::format("; it buckles at {:.2g} % of the path", 100 * *report.buckling_share);
}

}  // namespace limber::beams::detail
