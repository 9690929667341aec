// Newton's steps: Hessians, their factors, and the results that need no other factor.

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/numerics/raise_shift.h"
#include "engine/base/random.h"
#include "engine/rods/equilibrium/newton_run.h"

namespace limber::rods::detail {
namespace {

// "Imbalance" is max_gradient_scaled of the report, dimensionless. None of these numbers is known
// to have been tuned.

// Factor of the shift that makes a Hessian positive definite, from one trial to the next.
constexpr double kShiftGrowth = 6;
// Imbalance that no equilibrium is near to.
constexpr double kFarShare = 0.3;
// Forces below kLeft times those left in balance count as zero: the share of the scale of forces
// that the tolerance allows, or kFinest where that is smaller.
constexpr double kLeft = 10;
constexpr double kFinest = 1e-8;  // of the scale of forces
// Imbalance below which the next part of a prescribed path begins; turns of that part [rad].
constexpr double kSettled = 0.05;
constexpr double kPrescribedTurn = 0.1;  // [rad]
// Steps with one factor, and the share of the imbalance that each may leave.
constexpr int kChords = 3;
constexpr double kChordContraction = 0.3;  // of the imbalance
// Corrections that are only shown: the first may turn by so much [rad], the others are shorter.
constexpr double kShownTurn = 0.2;
constexpr double kShownPart = 0.2;  // of the one before
constexpr int kShownParts = 3;
constexpr double kMaxSolveError = 1e-4;  // of a solution, by a factor of an indefinite matrix
// How often a step is shortened, and by which factor it may turn beyond the trust radius.
constexpr int kShortenings = 3;
constexpr double kLoose = 1.5;  // of the trust radius: longer steps are damped

bool same_matrix(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a == b;
}

}  // namespace

/// @returns whether the shifted Hessian is positive definite under the constraints
bool NewtonRun::factor(double shift) {
  throw_if_interrupted();  // while there is still the factor before
  if (is_watched_) keep_unshifted_factor();
  HessianFactor& made = *work_.factor;
  made.bordered.reset();
  made.fixed = fixed();
  made.solver.set_pinned(made.fixed);
  ++report_.factorizations;
  report_.final_shift = made.shift = shift;
  const PivotCount pivots = made.solver.factor(work_.matrix, shift);
  report_.negative_eigenvalues = pivots.negative;
  // Each constraint can hold one unstable direction.
  const int held = static_cast<int>(holding_.rows().rows());
  if (pivots.vanishing > 0 || pivots.negative > held) {
    report_.negative_eigenvalues = pivots.negative;
    return false;
  }
  made.border(holding_.rows());
  report_.negative_eigenvalues = made.bordered->negative();
  return made.bordered->positive_definite();
}

void NewtonRun::keep_unshifted_factor() {
  if (!work_.factor->bordered || work_.factor->shift != 0) return;
  if (!work_.unshifted) {
    work_.unshifted = std::make_unique<HessianFactor>(model_.chains());
    work_.unshifted->solver.set_shift_weights(work_.scales.weights());
  }
  std::swap(work_.factor, work_.unshifted);
}

/// Factors with no shift, whatever its inertia. Pivots are not exchanged: if they are too small to
/// solve with, a share of the material stiffness is subtracted first. A symmetric part alone is
/// singular for arcs of half turns, and a rod between held ends for full ones.
/// @returns whether the factor solves
bool NewtonRun::factor_indefinite(const LinkageState& state) {
  const auto is_solved = [&](double max_error) {
    if (!factor(0) && !work_.factor->bordered && work_.factor->solver.pivots().vanishing == 0)
      work_.factor->border(holding_.rows());
    return work_.factor->bordered && solves(max_error);
  };
  if (is_solved(kMaxSolveError)) return true;
  assemble_material(state);
  work_.matrix.add(-kMaterialShare, *work_.material);
  const bool solved = is_solved(10 * kMaxSolveError);
  work_.factor->shift = -kMaterialShare;  // no factor of the Hessian
  return solved;
}

/// Does the last factor give back a motion from the forces that it makes?
/// @param max_error  share of the motion
bool NewtonRun::solves(double max_error) const {
  Random random(7);
  Eigen::VectorXd motion(work_.gradient.size()), found(work_.gradient.size());
  for (double& value : motion) value = random.normal();
  for (const int unknown : work_.factor->fixed) motion[unknown] = 0;
  work_.matrix.multiply(motion, found);
  for (const int unknown : work_.factor->fixed) found[unknown] = 0;
  solve(found, work_.factor->rows * motion);
  return (found - motion).norm() <= max_error * motion.norm();
}

/// Factors with no shift, with one that is lost in rounding (mechanisms), or with the least of a
/// growing series that makes the Hessian positive definite.
void NewtonRun::factor_positive(double least, const LinkageState& state) {
  const double rounding = work_.scales.rounding_shift();
  indefinite_ = false;
  stable_ = least == 0 && factor(0);
  if (stable_) return;
  const int negative = report_.negative_eigenvalues;
  // If nothing resists some motion, its eigenvalue has any sign.
  const bool mechanism =
      work_.mechanism || work_.factor->solver.pivots().vanishing > 0 || balanced();
  stable_ = least == 0 && mechanism && factor(rounding);
  work_.mechanism = stable_;
  if (stable_) return;
  if (least == 0 && report_.max_gradient_scaled > kFarShare) {
    // Far from balance rods are compressed by steps, not by the forces that they carry.
    assemble(state, Compression::kLeftOut);
    const bool convex = factor(0);
    report_.negative_eigenvalues = negative;
    if (convex) return;
  }
  factor_shifted(least > 0 ? least : work_.shift / kShiftGrowth, work_.shift);
  indefinite_ = least == 0 || report_.final_shift > least;
  report_.negative_eigenvalues = negative;
}

/// Factors with the first shift of a growing series that makes the matrix positive definite, and
/// keeps it.
void NewtonRun::factor_shifted(double first, double& kept) {
  const double least = std::max(first, kShiftGrowth * work_.scales.rounding_shift());
  const auto shift = raise_shift({least, kShiftGrowth}, [&](double s) { return factor(s); });
  LIMBER_DEMAND(shift.has_value());
  kept = *shift;
}

void NewtonRun::solve(Eigen::VectorXd& right_side, const Eigen::VectorXd& rows) const {
  Eigen::VectorXd forces = rows;
  work_.factor->bordered->solve_in_place(right_side, forces);
}

NewtonRun::Step NewtonRun::newton_step(const LinkageState& state) {
  // A guess compresses rods by mistake: the first step lets them have their length again.
  const bool far = report_.max_gradient_scaled > kFarShare;
  if (damping_ == 0 && report_.iterations == 1 && far && !work_.expected) {
    assemble(state, Compression::kLeftOut);
    if (!factor(0)) factor_shifted(work_.guess_shift / kShiftGrowth, work_.guess_shift);
    return step_with_factor(state);
  }
  assemble(state, Compression::kBuckles);
  factor_positive(damping_, state);
  Step step = step_with_factor(state);
  if (gap_.size < kSmallGap) shorten(state, step);
  return step;
}

/// Steps that turn by more than is believed are made again with a larger shift, which shortens them
/// where nothing much resists (Levenberg, Marquardt).
void NewtonRun::shorten(const LinkageState& state, Step& step) {
  for (int round = 0; round < kShortenings; ++round) {
    if (step.undamped_turn <= kLoose * radius_) break;
    const double all = curvature(step);
    const double own = std::max(all - report_.final_shift, 0.0);
    damping_ = std::max(all * step.undamped_turn / radius_ - own, 2 * report_.final_shift);
    factor_shifted(damping_, work_.shift);
    step = step_with_factor(state);
  }
  shrink(kLoose * radius_, step);
}

/// Newton's step with the last factor, wherever that was made. While prescribed values are far off
/// and the linkage has not settled, it settles first: steps then keep the constraints unchanged.
NewtonRun::Step NewtonRun::step_with_factor(const LinkageState& state) const {
  const bool far = gap_.size >= kSmallGap;
  const bool settled = report_.max_gradient_scaled < kSettled;
  Step step{-work_.gradient, far && settled, 0, 0, 0};
  if (far && !settled) {
    for (const int unknown : fixed()) step.x[unknown] = 0;
    solve(step.x, Eigen::VectorXd::Zero(gap_.rows.size()));
    limit(state, options_.largest_turn, step);
    return step;
  }
  if (!gap_.pinned.isZero(0)) {
    // The other unknowns follow the pinned ones.
    Eigen::VectorXd follow(step.x.size());
    work_.matrix.multiply(gap_.pinned, follow);
    step.x -= follow;
  }
  for (const int unknown : holding_.pinned()) step.x[unknown] = gap_.pinned[unknown];
  for (const int unknown : bounded_) step.x[unknown] = 0;
  solve(step.x, gap_.rows);
  limit(state, far ? std::min(options_.largest_turn, kPrescribedTurn) : options_.largest_turn,
        step);
  return step;
}

LinkageEquilibrium::Motion NewtonRun::motion_to(NewtonRun& ahead, const LinkageState& state) {
  const std::vector<int>& pinned = holding_.pinned();
  // Behind the pinned ones are lengths on their bound, which stay there.
  const HessianFactor& made = *work_.factor;
  const bool same_pins = ahead.holding_.pinned() == pinned && made.fixed.size() >= pinned.size() &&
                         std::equal(pinned.begin(), pinned.end(), made.fixed.begin());
  if (!work_.certified || !same_pins || !same_matrix(made.rows, holding_.rows()) ||
      !same_matrix(ahead.holding_.rows(), made.rows))
    return {};
  LinkageEquilibrium::Motion motion;
  motion.left = -work_.gradient;
  for (const int unknown : made.fixed) motion.left[unknown] = 0;
  const Holding::Gap gap = holding_.gap(state);
  solve_with_moments(motion.left, gap.rows);

  const Holding::Gap next = ahead.holding_.gap(state);
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(work_.gradient.size());
  Eigen::VectorXd here = forces;
  ahead.terms_.add_gradient(state, forces);
  terms_.add_gradient(state, here);
  motion.ahead = here - forces;
  const Eigen::VectorXd moved = next.pinned - gap.pinned;
  if (!moved.isZero(0)) {
    // The other unknowns follow the pinned ones.
    work_.matrix.multiply(moved, forces);
    motion.ahead -= forces;
  }
  for (const int unknown : made.fixed) motion.ahead[unknown] = moved[unknown];
  solve_with_moments(motion.ahead, next.rows - gap.rows);
  return motion;
}

/// Steps with the factor at hand while they pay: one of them costs a fraction of a new factor.
/// @returns whether the state is balanced now
bool NewtonRun::chords(LinkageState& state, const IterateCallback& on_iterate) {
  const bool is_minimum = work_.factor->bordered && work_.factor->bordered->positive_definite();
  if (has_free_moments() && !is_minimum) return false;  // nothing falls along its steps
  for (int round = 0; round < kChords; ++round) {
    if (round > 0) throw_if_interrupted();
    if (!work_.factor->bordered || work_.factor->fixed != fixed()) return false;
    if (!same_matrix(work_.factor->rows, holding_.rows())) work_.factor->border(holding_.rows());
    Step step = step_with_factor(state);
    if (along_.size() > 0 && !step.prescribed) step.x = beside(step.x, along_);
    if (!step.x.allFinite() || bound_fraction(state, step.x) < 1) return false;
    if (step.prescribed) {
      if (round > 0) return false;
      ++report_.corrections;
      move_prescribed(state, step.x);
      show(state, on_iterate);
      continue;
    }
    LinkageState next = state.moved(model_, step.x);
    if (!(potential(next) + terms_.moment_potential(step.x) <= potential_ + rounding())) {
      if (on_iterate && report_.iterations == 0 && round == 0)
        show_correction(state, step, on_iterate);
      return false;
    }
    ++report_.corrections;
    const double before = report_.max_gradient_scaled;
    accept(state, std::move(next), step.x, step.x);
    show(state, on_iterate);
    if (balanced()) return true;
    if (report_.max_gradient_scaled > kChordContraction * before) return false;
  }
  return false;
}

/// For clients that watch. If a step with the factor at hand ends higher, since straight motion
/// stretches rods, a shorter one or the same factor corrects that. Shows the first of a few shapes
/// that is lower than the state. The search does not continue from it, so that equilibria are the
/// same with and without clients that watch. If the search is interrupted before its first step,
/// however, the next search starts from it. It is not interrupted itself, since the next edit would
/// only begin it again.
void NewtonRun::show_correction(const LinkageState& state, const Step& step,
                                const IterateCallback& on_iterate) {
  const auto is_lower = [&](const Shown& trial) {
    return potential(trial.state) + terms_.moment_potential(trial.increment) < potential_;
  };
  double part = std::min(1.0, kShownTurn / step.turn);
  for (int round = 0; round < kShownParts; ++round, part *= kShownPart) {
    Shown trial{state.moved(model_, part * step.x), part * step.x};
    // The whole step is known to end higher.
    bool is_found = part < 1 && is_lower(trial);
    if (!is_found && round == 0) is_found = correct(trial) && is_lower(trial);
    if (!is_found) continue;
    shown_ = std::move(trial);
    return show(shown_->state, on_iterate);
  }
}

/// Takes back, with the factor at hand, the stretching by a step; the length of the step stays.
bool NewtonRun::correct(Shown& trial) {
  Eigen::VectorXd& gradient = work_.scratch;
  (void)work_.assembly.gradient(trial.state, gradient);
  terms_.add_gradient(trial.state, gradient);
  Eigen::VectorXd back = -gradient;
  for (const int unknown : work_.factor->fixed) back[unknown] = 0;
  solve(back, Eigen::VectorXd::Zero(work_.factor->rows.rows()));
  back = beside(std::move(back), trial.increment);
  const double turn = work_.scales.largest_turn(model_, trial.state, trial.increment);
  if (!(work_.scales.largest_turn(model_, trial.state, back) <= turn) ||
      bound_fraction(trial.state, back) < 1)
    return false;
  trial.state = trial.state.moved(model_, back);
  trial.increment += back;
  return true;
}

/// Turns stay moderate.
void NewtonRun::limit(const LinkageState& state, double largest, Step& step) const {
  step.turn = step.undamped_turn = work_.scales.largest_turn(model_, state, step.x);
  step.slope = work_.gradient.dot(step.x);
  shrink(largest, step);
}

void NewtonRun::shrink(double largest, Step& step) {
  if (step.turn <= largest) return;
  const double share = largest / step.turn;
  step.x *= share;
  step.slope *= share;
  step.turn = largest;
}

/// Is a balanced state stable? Earlier factors do not show it: the last step's forces may buckle
/// it.
bool NewtonRun::certify(const LinkageState& state) {
  assemble(state, Compression::kBuckles, WeakHolds::kLeftOut);
  stable_ = factor(0);
  if (stable_) return true;
  const int negative = report_.negative_eigenvalues;
  if (has_free_moments()) {
    stable_ = returns_slowly(state);
    report_.is_minimum = !stable_;
    if (stable_) return true;
  }
  const int diverging = has_free_moments() ? report_.negative_eigenvalues : negative;
  // If nothing resists some motion, its eigenvalue has the sign of rounding or of the remaining
  // forces; in the latter case the potential decides. Coordinates that are rounded press edges
  // together too, also where nothing else does. In all cases such a motion is reported as soft.
  const double rounding_shift = work_.scales.rounding_shift();
  const bool is_rounding = factor(rounding_shift);
  const double left = std::max(kLeft * std::min(options_.tolerance, kFinest) * scale_.force,
                               work_.scales.force_rounding(beyond_));
  stable_ = factor(rounding_shift + work_.scales.pressure_shift(left)) &&
            (is_rounding || !has_descent_direction(state));
  if (stable_) return true;
  factor_shifted(work_.shift / kShiftGrowth, work_.shift);
  report_.negative_eigenvalues = diverging;
  return false;
}

}  // namespace limber::rods::detail
