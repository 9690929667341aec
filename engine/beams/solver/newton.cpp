#include "engine/beams/solver/newton.h"

#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/numerics/line_search.h"
#include "engine/base/numerics/raise_shift.h"
#include "engine/beams/solver/stability.h"
#include "engine/beams/solver/taut_cables.h"
#include "engine/beams/solver/zero_modes.h"

namespace limber::beams::detail {

namespace {

constexpr double kLargestTurnOfIteration = 0.7;  // of one iteration [rad]
constexpr int kBadSteps = 4;        // in a row without gain, before the best state is restored
constexpr int kCareful = 3;         // steps with a line search after that
constexpr int kAfterFork = 4;       // iterations where forks are avoided
constexpr double kSameSide = 1e-9;  // relative difference of energies that does not decide the side
constexpr double kFirstOfFork = 1e-5;  // [rad]
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Multiple of the softest bending, per weight: it is added to a stiffness that has neutral
// directions, so that steps do not go along them. Steps in others are off by 1e-6 of their size at
// most.
constexpr double kNeutralShift = 1e-4;
// Turn of a family of equilibria about its axis over the largest turn of a node or chord along it.
// A flat arch between clamps turns about their line by its slope's inverse as much.
constexpr double kTurnOfFamily = 30;
// Share of the material's resistance that is left along a neutral direction, at most.
constexpr double kCancelled = 1e-3;

}  // namespace

NewtonSolver::NewtonSolver(const BeamStructure& structure, const JobContext& context)
    : structure_(structure), context_(context), balance_(structure), stiffness_(structure) {
  weights_ = stiffness_.restricted(balance_.weights());
}

bool NewtonSolver::factor_at(double shift) {
  Eigen::SparseMatrix<double> shifted = stiffness_.matrix();
  if (shift > 0) {
    for (int i = 0; i < stiffness_.size(); ++i)
      shifted.valuePtr()[shifted.outerIndexPtr()[i]] += shift * weights_[i];
  }
  if (stiffness_.size() == 0) return true;
  ++factorizations_;
  try {
    if (!analysed_) factor_.analyse(shifted);
    analysed_ = true;
    factor_.refactor(shifted);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kNumerical) throw;
    return false;
  }
  return true;
}

/// Out of balance, a neutral direction curves by as much, up or down.
bool NewtonSolver::factor_regularized() {
  for (const double factor : {1.0, 1e2, 1e4}) {
    regularization_ = factor * kNeutralShift * balance_.softest();
    if (factor_at(regularization_)) return true;
  }
  return false;
}

NewtonSolver::Definiteness NewtonSolver::factor_positive(const BeamState& state,
                                                         const NodeLoads& loads, Forks forks) {
  const double before = shift_;
  shift_ = 0;
  stiffness_.assemble(state, loads);
  // Nodes that coincide, or places that numbers hardly hold.
  is_positive_ = stiffness_.matrix().coeffs().allFinite();
  if (!is_positive_) return Definiteness::kNotFinite;
  is_positive_ = regularization_ > 0 ? factor_regularized() : factor_at(0);
  if (is_positive_) return Definiteness::kPositive;
  // Without the effects of compression, steps are sure and short. Off the end of a branch the
  // stiffness is but little below a positive one, and a shift as little leads on.
  if (forks != Forks::kDescended) {
    stiffness_.assemble(state, Compression::kLeftOut);
    if (!stiffness_.matrix().coeffs().allFinite()) return Definiteness::kNotFinite;
    if (factor_at(0)) return Definiteness::kNot;
  }
  // Begin below the shift that did last time.
  const ShiftSeries shifts{before > 0 ? 0.1 * before : balance_.softest(), 10};
  const auto shift = raise_shift(
      shifts, [&](double s) { return std::isfinite(s * weights_.maxCoeff()) && factor_at(s); });
  shift_ = shift.value_or(0);
  return shift ? Definiteness::kNot : Definiteness::kNotFinite;
}

Eigen::VectorXd NewtonSolver::residual(const BeamState& state, const NodeLoads& loads) const {
  return elastic_gradient(structure_, state) - load_vector(structure_, loads, state);
}

double NewtonSolver::potential_change(double energy, const Eigen::VectorXd& load,
                                      const BeamState& to, const NodeLoads& loads,
                                      const Eigen::VectorXd& increments) const {
  // Work of loads that turn along the path: the trapezoidal rule.
  const Eigen::VectorXd mean = 0.5 * (load + load_vector(structure_, loads, to));
  return elastic_energies(structure_, to).total() - energy - mean.dot(increments);
}

Eigen::VectorXd NewtonSolver::curvature(const BeamState& state, const NodeLoads& loads,
                                        const Eigen::VectorXd& residual_here,
                                        const Eigen::VectorXd& step) {
  const auto residual_at = [&](const BeamState& at) { return residual(at, loads); };
  const Eigen::VectorXd third = balance_.third_derivative(residual_at, state, residual_here, step);
  return stiffness_.extended(-solved(stiffness_.restricted(third)));
}

NewtonSolver::Trial NewtonSolver::go_along(const BeamState& state, const NodeLoads& loads,
                                           double energy, const Eigen::VectorXd& load,
                                           const Eigen::VectorXd& step, const Eigen::VectorXd& bend,
                                           double t) const {
  const Eigen::VectorXd increments = t * step + (0.5 * t * t) * bend;
  Trial trial;
  trial.state = structure_.moved(state, increments);
  trial.change = potential_change(energy, load, trial.state, loads, increments);
  return trial;
}

NewtonSolver::Trial NewtonSolver::try_step(const BeamState& state, const NodeLoads& loads,
                                           double energy, const Eigen::VectorXd& load,
                                           const Eigen::VectorXd& step, const Eigen::VectorXd& bend,
                                           double t) const {
  Trial trial = go_along(state, loads, energy, load, step, bend, t);
  trial.scaled =
      balance_.imbalance(residual(trial.state, loads), balance_.present(trial.state, loads)).scaled;
  return trial;
}

bool NewtonSolver::search(BeamState& state, const NodeLoads& loads,
                          const Eigen::VectorXd& residual_here, const Eigen::VectorXd& step,
                          const Eigen::VectorXd& bend) {
  const double energy = elastic_energies(structure_, state).total();
  const Eigen::VectorXd load = load_vector(structure_, loads, state);
  const SufficientDecrease decrease{0, residual_here.dot(step)};
  const double rounding = 100 * kEpsilon * (energy + std::abs(load.dot(step)));
  const auto attempt = [&](double t) {
    const auto shorter = StepVerdict::retry(t / 2);
    if (balance_.size_of(t * step + (0.5 * t * t) * bend) > 3 * kLargestTurnOfIteration)
      return shorter;
    Trial trial = try_step(state, loads, energy, load, step, bend, t);
    // Steps whose gain is lost in rounding are judged by forces.
    const bool is_calmer = trial.change <= rounding && trial.scaled < 0.5 * left_.scaled;
    if (!is_calmer && !decrease.accepts(t, trial.change)) return shorter;
    state = std::move(trial.state);
    return StepVerdict::accept();
  };
  return backtrack({.shortest_step = 1e-6}, attempt).is_accepted;
}

bool NewtonSolver::advance(BeamState& state, const NodeLoads& loads,
                           const Eigen::VectorXd& residual_here, const Eigen::VectorXd& step) {
  const double energy = elastic_energies(structure_, state).total();
  const Eigen::VectorXd load = load_vector(structure_, loads, state);
  const double slope = residual_here.dot(step);
  Eigen::VectorXd bend = Eigen::VectorXd::Zero(step.size());
  if (balance_.size_of(step) > 1e-5) bend = curvature(state, loads, residual_here, step);
  if (!(balance_.size_of(step + 0.5 * bend) < 3 * kLargestTurnOfIteration)) bend.setZero();
  if (watch_.careful > 0) {
    --watch_.careful;
    return search(state, loads, residual_here, step, bend);
  }
  if (watch_.bad_steps == 0) {
    watch_.reference = state;
    watch_.rise = 0;
    watch_.scaled = left_.scaled;
  }
  Trial trial = try_step(state, loads, energy, load, step, bend, 1);
  watch_.rise += trial.change;
  if (watch_.rise <= kArmijoShare * std::min(slope, 0.0) || trial.scaled < 0.5 * watch_.scaled) {
    watch_.bad_steps = 0;
  } else if (++watch_.bad_steps > kBadSteps || !std::isfinite(watch_.rise)) {
    watch_.bad_steps = 0;
    watch_.careful = kCareful;
    state = watch_.reference;
    return true;
  }
  state = std::move(trial.state);
  return true;
}

/// By free unknowns, times squares: curvature that is only rounding of its summands, or so small
/// that any load would move it out of reach.
Eigen::VectorXd NewtonSolver::noise() const {
  const Eigen::VectorXd diagonal = stiffness_.matrix().diagonal();
  return 1e-7 * balance_.softest() * weights_ + 64 * kEpsilon * diagonal.cwiseAbs();
}

NewtonSolver::Verdict NewtonSolver::verdict(Stability stability,
                                            const Eigen::VectorXd& direction) const {
  Verdict result;
  result.stability = stability;
  result.direction = stiffness_.extended(direction);
  result.direction.cwiseProduct(balance_.weights().cwiseSqrt())
      .cwiseAbs()
      .maxCoeff(&result.unknown);
  return result;
}

NewtonSolver::Verdict NewtonSolver::judge(const BeamState& state, const NodeLoads& loads) {
  if (factor_positive(state, loads) == Definiteness::kNotFinite) return {};
  return judge_factored(state, loads, residual(state, loads));
}

/// With the last factor, by free unknowns; there may be none.
Eigen::VectorXd NewtonSolver::solved(const Eigen::VectorXd& right) const {
  if (stiffness_.size() == 0) return right;
  return factor_.solve(right);
}

/// The size of v^T K v below which it is only rounding, or only the imbalance. Along a curve of
/// equal energy with the tangent v and the curvature w, v^T K v = - g . w. For a rotation by an
/// angle, w is as large as v times that angle at each node, and across it.
double NewtonSolver::allowance(const Eigen::VectorXd& direction, const Eigen::VectorXd& noise,
                               const Eigen::VectorXd& left) const {
  const double rounding = direction.dot(noise.cwiseProduct(direction));
  if (left.size() == 0) return rounding;
  const Eigen::VectorXd all = stiffness_.extended(direction);
  const Eigen::VectorXd free = stiffness_.extended(stiffness_.restricted(left));
  double work = 0;
  for (Eigen::Index i = 0; i < 6 * structure_.nodes(); i += 3)
    work += free.segment<3>(i).norm() * all.segment<3>(i).norm();
  return rounding + kTurnOfFamily * balance_.size_of(all) * work;
}

/// The factor is that of the stiffness, but for a small shift: is there anything that nothing
/// resists?
NewtonSolver::Verdict NewtonSolver::judge_positive(const BeamState& state, const NodeLoads& loads,
                                                   const Eigen::VectorXd& left) {
  if (stiffness_.size() == 0) return {Stability::kStable, -1, stiffness_.extended({}), {}};
  const Eigen::VectorXd rounding = noise();
  const SoftestModes modes = softest_modes(
      stiffness_, factor_, weights_,
      [&](const Eigen::VectorXd& v) { return allowance(v, rounding, left); }, context_);
  if (modes.next_value < -allowance(modes.next, rounding, left))
    return verdict(Stability::kSaddle, modes.next);
  if (modes.zero.cols() == 0) {
    if (const auto loose =
            direction_that_slackens(structure_, state, stiffness_, factor_, rounding))
      return verdict(Stability::kMechanism, *loose);
    return verdict(Stability::kStable, modes.next);
  }
  stiffness_.assemble(state, Compression::kWithAllForcesLeftOut);
  const ZeroModes sorted = sorted_by_material(modes.zero, stiffness_, rounding);
  stiffness_.assemble(state, loads);
  Eigen::MatrixXd neutral(structure_.unknowns(), 0);
  const auto add_neutral = [&](const Eigen::VectorXd& v) {
    neutral.conservativeResize(Eigen::NoChange, neutral.cols() + 1);
    neutral.rightCols(1) = stiffness_.extended(v);
  };
  for (const auto& v : sorted.loose.colwise()) {
    if (std::abs(v.dot(stiffness_.times(v))) >= allowance(v, rounding, left)) continue;
    if (!rolls_at_half_a_turn(structure_, state, stiffness_.extended(v)))
      return verdict(Stability::kMechanism, v);
    add_neutral(v);
  }
  for (Eigen::Index i = 0; i < sorted.neutral.cols(); ++i) {
    const Eigen::VectorXd v = sorted.neutral.col(i);
    if (std::abs(v.dot(stiffness_.times(v))) <= kCancelled * sorted.resistance[i]) add_neutral(v);
  }
  if (neutral.cols() == 0) return verdict(Stability::kStable, modes.zero.col(0));
  is_positive_ = factor_regularized();
  Verdict result = verdict(Stability::kNeutral, stiffness_.restricted(neutral.col(0)));
  result.neutral = std::move(neutral);
  return result;
}

/// After factor_positive(state, loads). If the stiffness is not positive definite, the factor is
/// that of another matrix that is. Against it a direction is sought along which the stiffness is
/// negative.
NewtonSolver::Verdict NewtonSolver::judge_factored(const BeamState& state, const NodeLoads& loads,
                                                   const Eigen::VectorXd& left) {
  if (is_positive_) return judge_positive(state, loads, left);
  stiffness_.assemble(state, loads);
  const Eigen::VectorXd rounding = noise();
  const Eigen::VectorXd v =
      lowest_quotient(stiffness_.matrix(), factor_, weights_, context_).direction;
  if (v.dot(stiffness_.times(v)) < -allowance(v, rounding, left))
    return verdict(Stability::kSaddle, v);
  if (factor_regularized()) {
    Verdict result = judge_positive(state, loads, left);
    if (result.stability != Stability::kMechanism) return result;
  }
  regularization_ = 0;
  (void)factor_positive(state, loads);
  stiffness_.assemble(state, loads);
  const Inertia inertia = inertia_of(stiffness_.matrix(), rounding, context_);
  if (inertia.negative > 0) return verdict(Stability::kSaddle, inertia.direction);
  return verdict(Stability::kMechanism, v);
}

Eigen::VectorXd NewtonSolver::step_from(const Eigen::VectorXd& residual) const {
  return stiffness_.extended(solved(-stiffness_.restricted(residual)));
}

std::optional<double> NewtonSolver::turn_left(const BeamState& state, const NodeLoads& loads) {
  const Stability stability = judge(state, loads).stability;
  if (stability != Stability::kStable && stability != Stability::kNeutral) return std::nullopt;
  return balance_.size_of(step_from(residual(state, loads)));
}

int NewtonSolver::negative_eigenvalues(const BeamState& state, const NodeLoads& loads) {
  stiffness_.assemble(state, loads);
  if (!stiffness_.matrix().coeffs().allFinite()) return 0;
  ++factorizations_;
  return inertia_of(stiffness_.matrix(), noise(), context_).negative;
}

bool NewtonSolver::leave_saddle(BeamState& state, const NodeLoads& loads, const Verdict& saddle) {
  const double energy = elastic_energies(structure_, state).total();
  const Eigen::VectorXd load = load_vector(structure_, loads, state);
  const Eigen::VectorXd here = residual(state, loads);
  const Eigen::VectorXd unit = saddle.direction / balance_.size_of(saddle.direction);
  const Eigen::VectorXd bend = curvature(state, loads, here, unit);
  const auto attempt = [&](double t) {
    // To the lower side: beside a fork that a small load has parted, the branch that continues is
    // there. Sides that are the same but for rounding are not chosen by that.
    double lowest = 0;
    BeamState lower;
    for (const double signed_step : {t, -t}) {
      Trial trial = go_along(state, loads, energy, load, unit, bend, signed_step);
      if (!(trial.change < (1 + kSameSide) * lowest)) continue;
      lowest = trial.change;
      lower = std::move(trial.state);
    }
    if (!(lowest < 0)) return StepVerdict::retry(t / 2);
    state = std::move(lower);
    return StepVerdict::accept();
  };
  // Far enough that the gain is more than rounding, as the energy decreases with the square only.
  return backtrack({.first_step = 0.3, .shortest_step = 1e-5}, attempt).is_accepted;
}

bool NewtonSolver::take_fork(BeamState& state, const NodeLoads& loads) {
  const Verdict fork = judge_factored(state, loads, {});
  if (fork.stability != Stability::kSaddle) return false;
  const double energy = elastic_energies(structure_, state).total();
  const Eigen::VectorXd load = load_vector(structure_, loads, state);
  const Eigen::VectorXd here = residual(state, loads);
  const double side = here.dot(fork.direction) > 0 ? -1 : 1;
  const Eigen::VectorXd unit = side / balance_.size_of(fork.direction) * fork.direction;
  const Eigen::VectorXd bend = curvature(state, loads, here, unit);
  const double rounding = 100 * kEpsilon * (energy + std::abs(load.dot(unit)));
  Trial trial;
  BeamState valley;
  const double change = expand(
      {kFirstOfFork, kLargestTurnOfIteration, rounding},
      [&](double t) {
        trial = go_along(state, loads, energy, load, unit, bend, t);
        return trial.change;
      },
      [&](double) { valley = std::move(trial.state); });
  if (change < 0) state = std::move(valley);
  return change < 0;
}

bool NewtonSolver::is_hidden(const Eigen::VectorXd& residual_here, const NodeLoads& loads,
                             double tolerance, BeamState& state, Hidden& hidden) const {
  const PresentForces present = balance_.present(state, loads);
  if (balance_.imbalance(residual_here, present, Rounding::kCounted).scaled <= tolerance)
    return false;
  const double turn = balance_.size_of(step_from(residual_here));
  if (turn <= kResolvedTurn) return false;
  if (!(turn < hidden.turn)) {
    state = std::move(hidden.state);
    return false;
  }
  hidden = {turn, state};
  return true;
}

NewtonOutcome NewtonSolver::balance(BeamState& state, const LoadPath& path, double s,
                                    double tolerance, int iterations, Forks forks) {
  const NodeLoads loads = path.loads(s);
  watch_.bad_steps = watch_.careful = 0;
  has_forked_ = false;
  neutral_.resize(0, 0);
  int since_fork = 0;
  Hidden hidden;
  bool has_taken = false;  // in the iteration before
  for (int i = 0; i <= iterations; ++i) {
    context_.throw_if_cancelled();
    const Eigen::VectorXd held = path.held_increments(state, s);
    const bool moves = balance_.size_of(held) > 1e-12;
    const Eigen::VectorXd here = residual(state, loads);
    left_ = balance_.imbalance(here, balance_.present(state, loads));
    if (!here.allFinite() || factor_positive(state, loads, forks) == Definiteness::kNotFinite)
      return NewtonOutcome::kNoProgress;
    if (most_factorizations_ > 0 && factorizations_ >= most_factorizations_) break;
    if (!moves && left_.scaled <= tolerance) {
      const Verdict verdict = judge_factored(state, loads, here);
      neutral_ = verdict.neutral;
      if (verdict.stability == Stability::kMechanism) return NewtonOutcome::kMechanism;
      const bool is_neutral = verdict.stability == Stability::kNeutral;
      const bool is_stable = verdict.stability == Stability::kStable || is_neutral;
      if (is_stable && (i == iterations || !is_hidden(here, loads, tolerance, state, hidden)))
        return NewtonOutcome::kBalanced;
      if (!is_stable) {
        ++saddles_;
        saddle_unknown_ = verdict.unknown;
        if (!leave_saddle(state, loads, verdict)) return NewtonOutcome::kNoProgress;
        continue;
      }
    }
    if (i == iterations) break;
    ++iterations_;
    if (!moves && !is_positive_) {
      const bool is_first = !std::exchange(has_forked_, true);
      const bool takes =
          forks == Forks::kDescended ? !has_taken : is_first && forks == Forks::kTaken;
      has_taken = takes && take_fork(state, loads);
      if (has_taken) continue;
    }
    if (has_forked_ && forks == Forks::kAvoided && ++since_fork > kAfterFork) break;
    Eigen::VectorXd right = -stiffness_.restricted(here);
    if (moves) right -= stiffness_.from_held(held);
    Eigen::VectorXd step = stiffness_.extended(solved(right));
    if (moves) {
      step += held;
      if (balance_.size_of(step) > kLargestTurnOfIteration) return NewtonOutcome::kTooFar;
      const Eigen::VectorXd bend = curvature(state, loads, here, step);
      state = structure_.moved(state, step + 0.5 * bend);
      continue;
    }
    const double size = balance_.size_of(step);
    if (!(size < std::numeric_limits<double>::infinity())) return NewtonOutcome::kNoProgress;
    if (size > kLargestTurnOfIteration) step *= kLargestTurnOfIteration / size;
    if (!advance(state, loads, here, step)) return NewtonOutcome::kNoProgress;
  }
  return NewtonOutcome::kLimit;
}

}  // namespace limber::beams::detail
