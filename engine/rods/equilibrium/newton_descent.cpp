// From a step to the next shape: along curves and valleys, and away from saddles.

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/numerics/dense.h"
#include "engine/base/numerics/line_search.h"
#include "engine/base/random.h"
#include "engine/rods/equilibrium/newton_run.h"

namespace limber::rods::detail {
namespace {

// Share of the potential: its rounding may swallow such gains in large linkages.
constexpr double kNoise = 1e-10;
constexpr int kStifferTrials = 4;         // shifts that are tried at most
constexpr double kStiffening = 1e3;       // factor from one to the next
constexpr double kDifferenceTurn = 1e-2;  // [rad]
constexpr int kRecentrings = 2;           // corrections of one trial at most
constexpr double kLeastRecentred = 0.05;  // share of a step
constexpr double kWild = 0.5;             // of a step: corrections that turn more are none
// Shares of the gain that a step promised: poor and good ones; and their consequences.
constexpr double kPoorModel = 0.1;
constexpr double kGoodModel = 0.5;             // of the promised gain: the radius may grow
constexpr double kShrinking = 0.25;            // factor of the trust radius
constexpr double kLeastTrustRadiusRad = 1e-4;  // [rad]
constexpr double kFading = 0.2;                // of shifts
// Multiple of the curvature along a step: stiffer directions are held while the step is bent.
constexpr double kStiff = 1e5;
constexpr Eigen::Index kLanczosSteps = 60;  // iterations for the softest direction at most
constexpr double kSettledDirection = 1e-4;  // residual, of the eigenvalue
constexpr double kFirstEscape = 1e-4;       // [rad]
// Factor by which the gain of curvature along a direction must exceed that of forces.
constexpr double kBeyondForces = 4;

}  // namespace

/// How a step bends where the linkage follows it without stretching its rods: the second derivative
/// of the path on which the gradient changes linearly,
///
///   H a = -(D^3 E)[v, v] = -(g(e v) - 2 g + g(-e v)) / e^2.
///
/// Newton's model holds along v + a/2 much farther than along v alone, since straight motion of the
/// vertices stretches what only bends (geodesic acceleration: Transtrum, Sethna 2012). Gradients
/// are counted from their own states, which turns them by terms odd in e; the sum is free of them.
Eigen::VectorXd NewtonRun::acceleration(const LinkageState& state, const Eigen::VectorXd& v) {
  throw_if_interrupted();
  ++report_.corrections;
  const double turn = work_.scales.largest_turn(model_, state, v);
  const double small = std::min(1.0, kDifferenceTurn / turn);
  Eigen::VectorXd a = 2 * work_.gradient;
  Eigen::VectorXd beside(v.size());
  for (const double side : {small, -small}) {
    const LinkageState near = state.moved(model_, side * v);
    (void)work_.assembly.gradient(near, beside);
    terms_.add_gradient(near, beside);
    a -= beside;
  }
  a /= small * small;
  for (const int unknown : holding_.pinned()) a[unknown] = 0;
  for (const int unknown : bounded_) a[unknown] = 0;
  solve(a, Eigen::VectorXd::Zero(holding_.rows().rows()));
  return a;
}

/// The part of a correction beside a direction. The step decides how far to go along it, and the
/// corrections of Newton's matrix are wild where little resists there.
Eigen::VectorXd NewtonRun::beside(Eigen::VectorXd x, const Eigen::VectorXd& direction) const {
  const Eigen::VectorXd weighed = work_.scales.weights().cwiseProduct(direction);
  x -= (weighed.dot(x) / weighed.dot(direction)) * direction;
  return x;
}

/// Moves along a step, or a part of it.
bool NewtonRun::take(LinkageState& state, Step step) {
  for (int raise = 0;; ++raise) {
    double fraction = bound_fraction(state, step.x);
    if (step.prescribed) {
      move_prescribed(state, fraction * step.x);
      return true;
    }
    if (fraction < kShortestFraction && block(state, step.x)) {
      // Edges of joints that may not become shorter stay as they are.
      --raise;
      factor_positive(0, state);
      step = step_with_factor(state);
      continue;
    }
    if (descend(state, step, fraction)) return true;
    if (raise == kStifferTrials) return false;
    // The quadratic model is good for nothing here; a stiffer one turns towards the gradient.
    factor_positive(std::max(report_.final_shift, work_.scales.softest_eigenvalue()) * kStiffening,
                    state);
    step = step_with_factor(state);
  }
}

/// Factors so that only directions that are stiff compared with a step still move much: steps along
/// valleys are bent and taken back to the ground without motion elsewhere along it.
void NewtonRun::hold_soft(const Step& step) {
  double kept = 0;
  factor_shifted(std::min(kStiff * curvature(step), work_.scales.stiffest_eigenvalue()), kept);
}

/// Along a step, per weight, with the shift it was made with.
double NewtonRun::curvature(const Step& step) const {
  return -step.slope / step.x.dot(work_.scales.weights().cwiseProduct(step.x));
}

/// Takes back, with the factor at hand, the remaining stretching by a step along a curve.
/// @returns whether the potential is below a value then
bool NewtonRun::recentred(LinkageState& trial, double below, Eigen::VectorXd& x) {
  Eigen::VectorXd back(x.size());
  for (int round = 0; round < kRecentrings; ++round) {
    ++report_.corrections;
    (void)work_.assembly.gradient(trial, back);
    terms_.add_gradient(trial, back);
    back = -back;
    for (const int unknown : work_.factor->fixed) back[unknown] = 0;
    solve(back, Eigen::VectorXd::Zero(work_.factor->rows.rows()));
    back = beside(back, x);
    const double turn = work_.scales.largest_turn(model_, trial, back);
    if (!(turn < kWild * work_.scales.largest_turn(model_, trial, x))) return false;
    if (bound_fraction(trial, back) < 1) return false;
    trial = trial.moved(model_, back);
    x += back;
    if (potential(trial) + terms_.moment_potential(x) <= below) return true;
  }
  return false;
}

/// Goes where it has to, straight or along the curve, whichever stretches less. The energy may
/// rise.
void NewtonRun::move_prescribed(LinkageState& state, Eigen::VectorXd x) {
  LinkageState next = state.moved(model_, x);
  while (!std::isfinite(potential(next)) && x.cwiseAbs().maxCoeff() > 0) {
    x /= 2;
    next = state.moved(model_, x);
  }
  const Eigen::VectorXd linear = x;
  const Eigen::VectorXd curve = x + 0.5 * acceleration(state, x);
  if (work_.scales.largest_turn(model_, state, curve) < options_.largest_turn &&
      !(bound_fraction(state, curve) < 1)) {
    LinkageState bent = state.moved(model_, curve);
    if (potential(bent) < potential(next)) {
      next = std::move(bent);
      x = curve;
    }
  }
  accept(state, std::move(next), x, linear);
}

/// If a step's gain is lost in the potential's rounding, forces still decide.
bool NewtonRun::calmer(const LinkageState& trial) {
  Eigen::VectorXd gradient(work_.gradient.size());
  (void)work_.assembly.gradient(trial, gradient);
  terms_.add_gradient(trial, gradient);
  (void)holding_.remove_reactions(gradient);
  for (const int unknown : bounded_) gradient[unknown] = 0;
  return work_.scales.imbalance(gradient, scale_, options_.tolerance, beyond_) <
         report_.max_gradient_scaled;
}

/// Continues along a curve while the potential falls.
bool NewtonRun::farther(const LinkageState& state, const Step& step, const Eigen::VectorXd& bend,
                        LinkageState& there, Eigen::VectorXd& increment) {
  double best = potential(there) + terms_.moment_potential(increment);
  bool any = false;
  for (double reach = 2; reach * step.turn < options_.largest_turn; reach *= 2) {
    Eigen::VectorXd x = reach * step.x + 0.5 * reach * reach * bend;
    if (bound_fraction(state, x) < 1) break;
    LinkageState trial = state.moved(model_, x);
    double value = potential(trial) + terms_.moment_potential(x);
    if (!(value < best)) {
      if (!recentred(trial, best, x)) break;
      value = potential(trial) + terms_.moment_potential(x);
    }
    best = value;
    there = std::move(trial);
    increment = std::move(x);
    any = true;
  }
  return any;
}

/// The first point of a halving series along a step at which the potential is low enough.
bool NewtonRun::descend(LinkageState& state, const Step& step, double fraction) {
  Eigen::VectorXd bend;
  step_shift_ = report_.final_shift;
  const SufficientDecrease decrease{potential_, step.slope, rounding()};
  const auto attempt = [&](double part) {
    throw_if_interrupted();
    const auto shorter = StepVerdict::retry(part / 2);
    Eigen::VectorXd x = part * step.x;
    if (bend.size() > 0) x += 0.5 * part * part * bend;
    if (bound_fraction(state, x) < 1) return shorter;
    LinkageState trial = state.moved(model_, x);
    bool low = decrease.accepts(part, potential(trial) + terms_.moment_potential(x)) ||
               (-step.slope < kNoise * potential_size_ && calmer(trial));
    if (!low && bend.size() == 0) {
      hold_soft(step);
      bend = beside(acceleration(state, step.x), step.x);
      return StepVerdict::retry(part);
    }
    const bool straight = low;
    low = low || (part >= kLeastRecentred && recentred(trial, decrease.bound(part), x));
    if (!low) return shorter;
    along_.resize(0);
    if (bend.size() > 0 || step_shift_ > 0) along_ = step.x;
    if (bend.size() > 0 && part == 1 && farther(state, step, bend, trial, x)) {
      accept(state, std::move(trial), x);
      damping_ = 0;
      radius_ = options_.largest_turn;
      return StepVerdict::accept();
    }
    const double before = potential_;
    accept(state, std::move(trial), x, straight ? part * step.x : Eigen::VectorXd());
    update_trust_radius(step, part, before - potential_ - terms_.moment_potential(x));
    return StepVerdict::accept();
  };
  return backtrack({fraction, kShortestFraction}, attempt).is_accepted;
}

/// The trust region of the next steps, from how well the model predicted this one.
void NewtonRun::update_trust_radius(const Step& step, double fraction, double gain) {
  const double expected = -step.slope * fraction * (1 - fraction / 2);
  const double ratio = gain / expected;
  const double turn = fraction * step.turn;
  if (ratio < kPoorModel) {
    radius_ = kShrinking * turn;
  } else if (fraction < 1) {
    radius_ = turn;
  } else if (ratio > kGoodModel && turn > 0.5 * radius_) {
    radius_ = std::min(2 * std::max(turn, radius_), options_.largest_turn);
  }
  radius_ = std::max(radius_, kLeastTrustRadiusRad);
  damping_ = step_shift_ * kFading;
  if (damping_ < work_.scales.softest_eigenvalue()) damping_ = 0;
}

/// (H + shift W)^-1 W v under the constraints.
/// @pre the last factor is shifted
Eigen::VectorXd NewtonRun::softened(const Eigen::VectorXd& v) const {
  Eigen::VectorXd x = work_.scales.weights().cwiseProduct(v);
  for (const int unknown : fixed()) x[unknown] = 0;
  solve(x, Eigen::VectorXd::Zero(holding_.rows().rows()));
  return x;
}

/// The direction of most negative curvature per weight: Lanczos' method for (H + shift W)^-1 W, all
/// vectors kept orthogonal. Zero where nothing may move.
Eigen::VectorXd NewtonRun::softest_direction(const LinkageState& state) {
  Random random(7);
  const Eigen::VectorXd& weights = work_.scales.weights();
  const auto size_of = [&](const Eigen::VectorXd& v) {
    return std::sqrt(v.dot(weights.cwiseProduct(v)));
  };
  const Eigen::Index most = std::min<Eigen::Index>(kLanczosSteps, weights.size());
  Eigen::MatrixXd basis(weights.size(), most);
  Eigen::MatrixXd projected = Eigen::MatrixXd::Zero(most, most);
  Eigen::VectorXd next(weights.size());
  for (double& value : next) value = random.normal();
  // Projects to the subspace of all later vectors: none of it moves held unknowns.
  next = softened(next.cwiseQuotient(weights.cwiseSqrt()));
  if (size_of(next) == 0) return next;
  Eigen::VectorXd mix;
  for (Eigen::Index k = 0; k < most; ++k) {
    basis.col(k) = next / size_of(next);
    next = softened(basis.col(k));
    const auto known = basis.leftCols(k + 1);
    projected.col(k).head(k + 1) = known.transpose() * weights.cwiseProduct(next);
    next -= known * projected.col(k).head(k + 1);
    next -= known * (known.transpose() * weights.cwiseProduct(next));
    const SymmetricEigen eigen(
        projected.topLeftCorner(k + 1, k + 1).selfadjointView<Eigen::Upper>().toDenseMatrix());
    mix = eigen.eigenvectors().col(k);
    if (!(size_of(next) * std::abs(mix[k]) > kSettledDirection * eigen.eigenvalues()[k])) break;
  }
  Eigen::VectorXd v = basis.leftCols(mix.size()) * mix;
  Eigen::Index largest = 0;
  (void)v.cwiseProduct(weights.cwiseSqrt()).cwiseAbs().maxCoeff(&largest);
  if (v[largest] < 0) v = -v;
  return v / work_.scales.largest_turn(model_, state, v);
}

/// Does the potential fall along the softest direction by more than the remaining forces explain?
/// @pre the last factor is shifted
bool NewtonRun::has_descent_direction(const LinkageState& state) {
  const Eigen::VectorXd direction = softest_direction(state);
  const Eigen::VectorXd bend = beside(acceleration(state, direction), direction);
  Eigen::VectorXd left;
  (void)free_gradient(left);
  const auto down = [&](const Eigen::VectorXd& increment) {
    const std::optional<Escape> found = follow(state, increment, bend);
    return found && found->gain > kBeyondForces * std::abs(left.dot(found->increment));
  };
  return down(direction) || down(-direction);
}

/// Leaves a saddle along negative curvature, as far as that leads down.
/// @pre the last factor is shifted
bool NewtonRun::escape(LinkageState& state) {
  const Eigen::VectorXd direction = softest_direction(state);
  const Eigen::VectorXd bend = beside(acceleration(state, direction), direction);
  // The opposite direction where this one leads up: beyond a limit point only one leads down.
  std::optional<Escape> found = follow(state, direction, bend);
  if (!found) found = follow(state, -direction, bend);
  if (!found) return false;
  ++report_.escapes;
  accept(state, std::move(found->there), found->increment, found->along);
  along_ = direction;
  return true;
}

/// As far as a direction leads down.
std::optional<NewtonRun::Escape> NewtonRun::follow(const LinkageState& state,
                                                   const Eigen::VectorXd& direction,
                                                   const Eigen::VectorXd& bend) const {
  Eigen::VectorXd x;
  std::optional<LinkageState> trial;
  std::optional<Escape> found;
  const auto change_at = [&](double turn) {
    x = turn * direction + 0.5 * turn * turn * bend;
    if (bound_fraction(state, x) < 1) return std::numeric_limits<double>::quiet_NaN();
    trial = state.moved(model_, x);
    return potential(*trial) + terms_.moment_potential(x) - potential_;
  };
  const double change =
      expand({kFirstEscape, options_.largest_turn, rounding()}, change_at, [&](double turn) {
        found = Escape{std::move(*trial), std::move(x), turn * direction};
      });
  if (found) found->gain = -change;
  return found;
}

}  // namespace limber::rods::detail
