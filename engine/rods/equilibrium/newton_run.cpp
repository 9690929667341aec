#include "engine/rods/equilibrium/newton_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/random.h"

namespace limber::rods::detail {
namespace {

constexpr double kGapTolerance = 1e-12;
constexpr double kArmijo = 1e-4;
constexpr double kShortestFraction = 1e-7;
constexpr double kRelativeRounding = 1e-13;
// Of the shift that makes a Hessian positive definite, from one trial to the next.
constexpr double kShiftGrowth = 6;
constexpr int kPowerIterations = 12;
// Steps with one factor, and by how much each has to lower the imbalance.
constexpr int kChords = 3;
constexpr double kChordContraction = 0.3;
constexpr double kFirstEscape = 1e-4;  // [rad]
constexpr double kEscapeGrowth = 2;
constexpr double kDifferenceTurn = 1e-2;  // [rad]

bool same(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a == b;
}

}  // namespace

NewtonWorkspace::NewtonWorkspace(const LinkageModel& linkage)
    : model(linkage),
      scales(linkage),
      assembly(linkage),
      matrix(linkage.chains()),
      solver(linkage.chains()),
      gradient(linkage.variables().size()),
      total_increment(Eigen::VectorXd::Zero(linkage.variables().size())) {
  solver.set_shift_weights(scales.masses());
}

NewtonRun::NewtonRun(NewtonWorkspace& workspace, const Conditions& conditions,
                     const EquilibriumOptions& options, const LinkageState& start)
    : work_(workspace),
      model_(workspace.model),
      options_(options),
      terms_(model_, conditions),
      holding_(model_, conditions, terms_, workspace.scales, start),
      shortest_(conditions.shortest_joint_edge) {
  work_.total_increment.setZero();
}

void NewtonRun::finish(EquilibriumStatus status, std::string message) {
  report_.status = status;
  report_.message = std::move(message);
}

EquilibriumReport NewtonRun::run(LinkageState& state, const JobContext& context,
                                 const IterateCallback& on_iterate) {
  evaluate(state);
  for (;;) {
    if (context.cancellation.requested()) {
      finish(EquilibriumStatus::kCancelled, "cancelled by the caller");
      break;
    }
    if (balanced()) {
      if (stable_ || certify(state)) {
        finish(EquilibriumStatus::kConverged,
               fmt::format("balanced to {:.1e}", report_.max_gradient_scaled));
        break;
      }
      if (report_.escapes < options_.max_escapes && escape(state)) continue;
      finish(EquilibriumStatus::kSaddle,
             fmt::format("balanced, but unstable in {} directions", report_.negative_eigenvalues));
      break;
    }
    if (report_.iterations == options_.max_iterations) {
      finish(EquilibriumStatus::kIterationLimit,
             fmt::format("{} Newton steps left an imbalance of {:.1e}", report_.iterations,
                         report_.max_gradient_scaled));
      break;
    }
    if (chords(state)) continue;
    ++report_.iterations;
    if (!take(state, newton_step(state))) {
      finish(EquilibriumStatus::kStalled,
             fmt::format("no step lowers the potential; the imbalance is {:.1e}",
                         report_.max_gradient_scaled));
      break;
    }
    if (on_iterate) on_iterate(report_.iterations, state);
  }
  return report_;
}

/// Energy, gradient and what is to be judged by them.
void NewtonRun::evaluate(const LinkageState& state) {
  report_.energies = work_.assembly.gradient(state, work_.gradient);
  terms_.add_gradient(state, work_.gradient);
  const ConditionTerms::Potential loads = terms_.potential(state);
  report_.spring_energy = loads.springs;
  report_.load_potential = loads.loads;
  potential_ = report_.potential();
  potential_size_ = report_.energies.total() + loads.size;
  gap_ = holding_.gap(state);
  set_active_bounds(state);

  Eigen::VectorXd free = work_.gradient;
  report_.mean_angle_moment =
      holding_.remove_reactions(free) / std::max(1, model_.variables().joints());
  for (const int unknown : bounded_) free[unknown] = 0;
  const GradientSize size = work_.scales.size_of(free);
  scale_ = work_.scales.present(report_.energies);
  scale_.force = std::max(scale_.force, terms_.largest_force(state)) +
                 work_.scales.force_rounding() / options_.tolerance;
  scale_.moment = std::max(scale_.moment, terms_.largest_moment()) +
                  work_.scales.moment_rounding() / options_.tolerance;
  report_.max_gradient_scaled = std::max(size.force / scale_.force, size.moment / scale_.moment);
}

void NewtonRun::assemble(const LinkageState& state) {
  (void)work_.assembly.hessian(state, work_.gradient, work_.matrix);
  terms_.add(state, work_.gradient, work_.matrix);
  holding_.add_weak_holds(work_.matrix);
}

/// Edges of joints that are as short as they may be and would become shorter.
void NewtonRun::set_active_bounds(const LinkageState& state) {
  std::vector<int> bounded;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    for (const Rod rod : {kRodA, kRodB}) {
      const int unknown = model_.variables().joint_begin(j) + kJointLengthA + rod;
      const double least = shortest_ * model_.rest_lengths().terminal(rod, j);
      const bool there = state.joints()[j].lengths[rod] <= least * (1 + 1e-12);
      if (there && work_.gradient[unknown] > 0) bounded.push_back(unknown);
    }
  }
  if (bounded == bounded_) return;
  bounded_ = std::move(bounded);
}

/// All unknowns that a step leaves where they are, or moves as prescribed.
std::vector<int> NewtonRun::fixed() const {
  std::vector<int> all = holding_.pinned();
  all.insert(all.end(), bounded_.begin(), bounded_.end());
  return all;
}

double NewtonRun::potential(const LinkageState& state) const {
  return work_.assembly.energies(state).total() + terms_.potential(state).total();
}

double NewtonRun::rounding() const {
  return kRelativeRounding * potential_size_ + work_.scales.energy_rounding();
}

bool NewtonRun::balanced() const {
  return gap_.size <= kGapTolerance && report_.max_gradient_scaled <= options_.tolerance;
}

/// @returns whether the shifted Hessian is positive definite under the constraints
bool NewtonRun::factor(double shift) {
  work_.bordered.reset();
  work_.fixed = fixed();
  work_.solver.set_pinned(work_.fixed);
  ++report_.factorizations;
  report_.final_shift = shift;
  const PivotCount pivots = work_.solver.factor(work_.matrix, shift);
  report_.negative_eigenvalues = pivots.negative;
  if (pivots.vanishing > 0) return false;
  border();
  report_.negative_eigenvalues = work_.bordered->negative();
  return work_.bordered->positive_definite();
}

/// Puts the constraints beside the last factor.
void NewtonRun::border() {
  work_.rows = holding_.rows();
  work_.bordered.emplace(work_.solver, work_.rows, Eigen::VectorXd::Zero(work_.rows.rows()));
}

/// Factors with no shift, with one that is lost in rounding (mechanisms), or with the least of a
/// growing series that makes the Hessian positive definite.
void NewtonRun::factor_positive(double least) {
  const double rounding = work_.scales.rounding_shift();
  stable_ = least == 0 && factor(0);
  if (stable_) return;
  const int negative = report_.negative_eigenvalues;
  // Where nothing resists some motion its eigenvalue has any sign.
  const bool mechanism = work_.mechanism || work_.solver.pivots().vanishing > 0 || balanced();
  stable_ = least == 0 && mechanism && factor(rounding);
  work_.mechanism = stable_;
  if (stable_) return;
  double shift = std::max({least, work_.shift / kShiftGrowth, kShiftGrowth * rounding});
  while (!factor(shift)) {
    shift *= kShiftGrowth;
    LIMBER_DEMAND(std::isfinite(shift));
  }
  work_.shift = shift;
  report_.negative_eigenvalues = negative;
}

void NewtonRun::solve(Eigen::VectorXd& right_side, const Eigen::VectorXd& rows) const {
  Eigen::VectorXd forces = rows;
  work_.bordered->solve_in_place(right_side, forces);
}

NewtonRun::Step NewtonRun::newton_step(const LinkageState& state) {
  assemble(state);
  factor_positive(0);
  return step_with_factor(state);
}

/// Newton's step with the last factor, wherever that was made.
NewtonRun::Step NewtonRun::step_with_factor(const LinkageState& state) const {
  Step step{-work_.gradient, gap_.size > kGapTolerance, 0};
  if (step.prescribed && !gap_.pinned.isZero(0)) {
    // Where pinned unknowns go, the others follow.
    Eigen::VectorXd follow(step.x.size());
    work_.matrix.multiply(gap_.pinned, follow);
    step.x -= follow;
  }
  for (const int unknown : holding_.pinned()) step.x[unknown] = gap_.pinned[unknown];
  for (const int unknown : bounded_) step.x[unknown] = 0;
  solve(step.x, gap_.rows);
  limit(state, step);
  return step;
}

/// Steps with the factor at hand while they pay: one of them costs a fraction of a new factor.
/// @returns whether the state is balanced now
bool NewtonRun::chords(LinkageState& state) {
  for (int round = 0; round < kChords; ++round) {
    if (!work_.bordered || work_.fixed != fixed()) return false;
    if (!same(work_.rows, holding_.rows())) border();
    const Step step = step_with_factor(state);
    if (!step.x.allFinite() || bound_fraction(state, step.x) < 1) return false;
    LinkageState next = state.moved(model_, step.x);
    if (!step.prescribed &&
        !(potential(next) + terms_.moment_potential(step.x) <= potential_ + rounding()))
      return false;
    ++report_.corrections;
    const double before = report_.max_gradient_scaled;
    accept(state, std::move(next), step.x);
    if (balanced()) return true;
    if (!step.prescribed && report_.max_gradient_scaled > kChordContraction * before) return false;
  }
  return false;
}

/// Turns stay moderate.
void NewtonRun::limit(const LinkageState& state, Step& step) const {
  const double turn = work_.scales.largest_turn(model_, state, step.x);
  if (turn > options_.largest_turn) step.x *= options_.largest_turn / turn;
  step.slope = work_.gradient.dot(step.x);
}

/// How much of a step keeps the edges of joints long enough.
double NewtonRun::bound_fraction(const LinkageState& state, const Eigen::VectorXd& x) const {
  double fraction = 1;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    for (const Rod rod : {kRodA, kRodB}) {
      const double change = x[model_.variables().joint_begin(j) + kJointLengthA + rod];
      const double room =
          state.joints()[j].lengths[rod] - shortest_ * model_.rest_lengths().terminal(rod, j);
      if (change < -room && change < 0)
        fraction = std::min(fraction, std::max(room, 0.0) / -change);
    }
  }
  return fraction;
}

void NewtonRun::accept(LinkageState& state, LinkageState next, const Eigen::VectorXd& x) {
  work_.total_increment += x;
  state = std::move(next);
  evaluate(state);
}

/// How a step bends where the linkage follows it without stretching its rods: the second derivative
/// of the way on which the gradient changes linearly,
///
///   H a = -(D^3 E)[v, v] = -(g(e v) - 2 g + g(-e v)) / e^2.
///
/// Newton's model holds along v + a/2 much farther than along v alone, since straight motion of the
/// vertices stretches what only bends (geodesic acceleration: Transtrum, Sethna 2012). Gradients
/// are counted from their own states, which turns them by terms odd in e; the sum is free of them.
Eigen::VectorXd NewtonRun::acceleration(const LinkageState& state, const Eigen::VectorXd& v) {
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

/// Moves along a step, or a part of it.
bool NewtonRun::take(LinkageState& state, Step step) {
  for (int raise = 0;; ++raise) {
    double fraction = bound_fraction(state, step.x);
    if (step.prescribed) {
      // The energy may rise until everything is where it has to be.
      accept(state, state.moved(model_, fraction * step.x), fraction * step.x);
      return true;
    }
    if (descend(state, step, fraction)) return true;
    if (raise == 4) return false;
    // The quadratic model is good for nothing here; a stiffer one turns towards the gradient.
    factor_positive(std::max(report_.final_shift, work_.scales.softest_eigenvalue()) * 1e3);
    step = step_with_factor(state);
  }
}

/// The first point of a halving series along a step at which the potential is low enough.
bool NewtonRun::descend(LinkageState& state, const Step& step, double fraction) {
  Eigen::VectorXd bend;
  for (; fraction > kShortestFraction; fraction /= 2) {
    Eigen::VectorXd x = fraction * step.x;
    if (bend.size() > 0) x += 0.5 * fraction * fraction * bend;
    if (bound_fraction(state, x) < 1) continue;
    LinkageState trial = state.moved(model_, x);
    const double below = potential_ + kArmijo * fraction * step.slope + rounding();
    if (potential(trial) + terms_.moment_potential(x) <= below) {
      accept(state, std::move(trial), x);
      return true;
    }
    if (bend.size() > 0) continue;
    bend = acceleration(state, step.x);
    fraction *= 2;
  }
  return false;
}

/// Is a balanced state stable? Nothing has been factored there yet, or only with a shift.
bool NewtonRun::certify(const LinkageState& state) {
  ++report_.iterations;
  assemble(state);
  factor_positive(0);
  return stable_;
}

/// The direction of most negative curvature per mass, by inverse iteration with the shifted factor.
Eigen::VectorXd NewtonRun::softest_direction(const LinkageState& state) {
  Random random(7);
  const Eigen::VectorXd& masses = work_.scales.masses();
  Eigen::VectorXd v(masses.size());
  for (double& value : v) value = random.normal();
  v = v.cwiseQuotient(masses.cwiseSqrt());
  for (int k = 0; k < kPowerIterations; ++k) {
    v = v.cwiseProduct(masses);
    for (const int unknown : holding_.pinned()) v[unknown] = 0;
    for (const int unknown : bounded_) v[unknown] = 0;
    solve(v, Eigen::VectorXd::Zero(holding_.rows().rows()));
    v /= std::sqrt(v.dot(masses.cwiseProduct(v)));
  }
  Eigen::Index largest = 0;
  (void)v.cwiseProduct(masses.cwiseSqrt()).cwiseAbs().maxCoeff(&largest);
  if (v[largest] < 0) v = -v;
  return v / work_.scales.largest_turn(model_, state, v);
}

/// Leaves a saddle along negative curvature, as far as that leads down.
/// @pre the last factor is shifted
bool NewtonRun::escape(LinkageState& state) {
  const Eigen::VectorXd direction = softest_direction(state);
  const Eigen::VectorXd bend = acceleration(state, direction);
  double best = potential_ - rounding();
  std::optional<LinkageState> there;
  Eigen::VectorXd way;
  for (double turn = kFirstEscape; turn <= options_.largest_turn; turn *= kEscapeGrowth) {
    Eigen::VectorXd x = turn * direction + 0.5 * turn * turn * bend;
    if (bound_fraction(state, x) < 1) break;
    LinkageState trial = state.moved(model_, x);
    const double value = potential(trial) + terms_.moment_potential(x);
    if (!(value < best)) break;
    best = value;
    there = std::move(trial);
    way = std::move(x);
  }
  if (!there) return false;
  ++report_.escapes;
  stable_ = false;
  accept(state, std::move(*there), way);
  return true;
}

}  // namespace limber::rods::detail
