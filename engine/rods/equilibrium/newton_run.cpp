#include "engine/rods/equilibrium/newton_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/rods/equilibrium/equilibrium_text.h"

namespace limber::rods::detail {
namespace {

constexpr double kGapTolerance = 1e-12;      // gap of prescribed values that counts as closed
constexpr double kRelativeRounding = 1e-13;  // of the potential's size
// Imbalance below which edges carry their expected tensions.
constexpr double kNearSolution = 1e-3;
// Imbalance from which Newton's method with the full tangent of moments is tried at once.
constexpr double kNearMoments = 0.3;
// Imbalance, and share of the turn that steps may have, that creep up to a saddle.
constexpr double kHard = 0.01;
constexpr double kCreeping = 0.05;  // of the allowed turn
// Share of the work of loads that rounding may leave, at once and where Newton's steps leave it.
constexpr double kEnergyNoise = 1e-6;
constexpr double kMaxNoise = 1e-2;  // of the work of loads, where Newton's steps leave it
// A step that moves nothing: turns [rad], and motions as shares of the extent.
constexpr double kStill = 1e-10;
constexpr double kNoBend = 1e-6;         // [rad]
constexpr int kHiddenLoadChecks = 2;     // checks with kEnergyNoise; later ones allow kMaxNoise
constexpr int kMaxHiddenLoadChecks = 4;  // before the solve ends as stalled
constexpr const char* kHiddenLoads =
    "the shortest edges are so stiff that rounding hides the loads: take fewer edges per segment, "
    "or longer segments";
// Turn of a joint up to which a factor of one state serves for a step from another [rad].
constexpr double kNearby = 0.1;

struct Interrupted {};

}  // namespace

NewtonWorkspace::NewtonWorkspace(const LinkageModel& linkage)
    : model(linkage),
      scales(linkage),
      sections(linkage.section_scales()),
      assembly(linkage),
      matrix(linkage.chains()),
      factor(std::make_unique<HessianFactor>(linkage.chains())),
      gradient(linkage.variables().size()),
      scratch(linkage.variables().size()),
      total_increment(Eigen::VectorXd::Zero(linkage.variables().size())),
      tensions(linkage) {
  factor->solver.set_shift_weights(scales.weights());
}

NewtonWorkspace& NewtonWorkspace::for_present_sections() {
  if (sections == model.section_scales()) return *this;
  sections = model.section_scales();
  scales = UnknownScales(model);
  factor->solver.set_shift_weights(scales.weights());
  unshifted.reset();
  guess_shift = shift = 0;
  certified = false;
  return *this;
}

void NewtonWorkspace::begin_at(const LinkageState& state) {
  // An announced guess is near an equilibrium, and data of the last search is discarded already.
  if (expected) return;
  const bool near = std::equal(end.begin(), end.end(), state.joints().begin(), state.joints().end(),
                               [](const JointState<double>& a, const JointState<double>& b) {
                                 return (a.normal - b.normal).norm() < kNearby &&
                                        (a.bisector - b.bisector).norm() < kNearby &&
                                        std::abs(a.opening_angle - b.opening_angle) < kNearby;
                               });
  if (near) return;
  factor->bordered.reset();
  if (unshifted) unshifted->bordered.reset();
  guess_shift = shift = 0;
  mechanism = false;
}

NewtonRun::NewtonRun(NewtonWorkspace& workspace, const Conditions& conditions,
                     const EquilibriumOptions& options, const LinkageState& start)
    : work_(workspace.for_present_sections()),
      model_(workspace.model),
      options_(options),
      terms_(model_, conditions),
      holding_(model_, conditions, terms_, workspace.scales, start),
      moments_(free_moments()),
      shortest_(conditions.shortest_joint_edge),
      radius_(options.largest_turn) {
  work_.total_increment.setZero();
}

void NewtonRun::finish(EquilibriumStatus status, std::string message) {
  report_.status = status;
  report_.message = std::move(message);
}

std::string NewtonRun::imbalance_text() const {
  Eigen::VectorXd free;
  (void)free_gradient(free);
  return detail::imbalance_text(model_.variables(), work_.scales, free, scale_, options_.tolerance,
                                beyond_);
}

std::string NewtonRun::converged_text() const {
  const std::string text = fmt::format("balanced to {:.1e}", report_.max_gradient_scaled);
  return report_.is_minimum ? text : fmt::format("{}; {}", text, kSlowMotionsOnly);
}

std::string NewtonRun::saddle_text() const {
  if (has_free_moments() && report_.negative_eigenvalues == 0)
    return "the shape is balanced, but whether it is stable under moments of fixed direction was "
           "not settled: load fewer joints with moments, or request a smaller change";
  return fmt::format(
      "the shape is balanced but unstable in {} {}, and no stable one was found near it: hold more "
      "joints, or request a smaller change",
      report_.negative_eigenvalues, report_.negative_eigenvalues == 1 ? "direction" : "directions");
}

const Eigen::VectorXd& NewtonRun::gradient_at(const LinkageState& state) {
  work_.certified = false;
  evaluate(state);
  return work_.gradient;
}

EquilibriumReport NewtonRun::judge(const LinkageState& state) {
  evaluate(state);
  const bool is_equilibrium = std::isfinite(potential_) && balanced() && certify(state);
  finish(is_equilibrium ? EquilibriumStatus::kConverged : EquilibriumStatus::kStalled,
         is_equilibrium ? converged_text() : imbalance_text());
  return report_;
}

Eigen::VectorXd NewtonRun::softest_at(const LinkageState& state) {
  work_.certified = false;
  evaluate(state);
  assemble(state, Compression::kBuckles);
  factor_positive(0, state);
  return softest_direction(state);
}

EquilibriumReport NewtonRun::run(LinkageState& state, const JobContext& context,
                                 const IterateCallback& on_iterate) {
  evaluate(state);
  cancellation_ = context.cancellation;
  is_watched_ = on_iterate != nullptr;
  try {
    search(state, on_iterate);
  } catch (const Interrupted&) {
    interrupt(state);
    finish(EquilibriumStatus::kCancelled, "cancelled by the caller");
  }
  report_.turned = work_.scales.largest_turn(model_, state, work_.total_increment);
  return report_;
}

/// Called before everything that takes as long as a factor, so that an edit waits for one of them
/// at most. Only accept() changes the state before, so that it is the last iterate. A watched solve
/// has shown a shape then: otherwise solves that are each interrupted by the next would make no
/// progress.
void NewtonRun::throw_if_interrupted() const {
  if (cancellation_.requested() && (has_shown_ || !is_watched_)) throw Interrupted{};
}

void NewtonRun::show(const LinkageState& state, const IterateCallback& on_iterate) {
  if (!on_iterate) return;
  has_shown_ = true;
  on_iterate(report_.iterations, state);
}

/// Prepares the best start for the next solve: the shape that was shown, and a factor of a true
/// Hessian.
void NewtonRun::interrupt(LinkageState& state) {
  if (shown_) {
    work_.total_increment += shown_->increment;
    state = std::move(shown_->state);
    shown_.reset();
    evaluate(state);
  }
  const bool is_plain = work_.factor->bordered && work_.factor->shift == 0;
  if (!is_plain && work_.unshifted && work_.unshifted->bordered)
    std::swap(work_.factor, work_.unshifted);
}

void NewtonRun::search(LinkageState& state, const IterateCallback& on_iterate) {
  for (;;) {
    if (cancellation_.requested()) throw Interrupted{};
    if (!std::isfinite(potential_)) {
      finish(EquilibriumStatus::kStalled, degenerate_text(model_, state));
      break;
    }
    if (balanced()) {
      if (!stable_ && !certify(state)) {
        if (report_.escapes < options_.max_escapes && escape(state)) continue;
        finish(EquilibriumStatus::kSaddle, saddle_text());
        break;
      }
      if (!hides_loads(state)) {
        finish(EquilibriumStatus::kConverged, converged_text());
        break;
      }
      if (++hidden_load_checks_ > kMaxHiddenLoadChecks) {
        finish(EquilibriumStatus::kStalled, kHiddenLoads);
        break;
      }
    }
    if (report_.iterations >= options_.max_iterations) {
      finish(EquilibriumStatus::kIterationLimit,
             fmt::format("no equilibrium was found in {} steps: {}; request a smaller change, or "
                         "release what holds the linkage there",
                         report_.iterations, imbalance_text()));
      break;
    }
    if (chords(state, on_iterate)) continue;
    const auto is_balanced_with_moments = [&] {
      if (!has_free_moments() || std::exchange(tried_moments_, true)) return false;
      if (!balance_with_moments(state)) return false;
      show(state, on_iterate);
      return true;
    };
    // Near an equilibrium its tangent leads to it, and the symmetric part elsewhere.
    if (report_.max_gradient_scaled < kNearMoments && is_balanced_with_moments()) continue;
    ++report_.iterations;
    const Step step = newton_step(state);
    if (indefinite_ && is_balanced_with_moments()) continue;
    if (towards_saddle(step)) {
      if (report_.escapes < options_.max_escapes && escape(state)) continue;
      if (options_.max_escapes == 0) {
        finish(EquilibriumStatus::kSaddle,
               "the shapes ahead are unstable: request a smaller change, or hold more joints");
        break;
      }
    }
    if (!take(state, step)) {
      finish(EquilibriumStatus::kStalled,
             balanced() ? kHiddenLoads
                        : fmt::format("the search for an equilibrium is stuck after {} steps: {}; "
                                      "request a smaller change, or begin from another shape",
                                      report_.iterations, imbalance_text()));
      break;
    }
    show(state, on_iterate);
  }
}

/// Computes energy, gradient and the scales that judge them.
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

  Eigen::VectorXd free;
  report_.mean_angle_moment = free_gradient(free) / std::max(1, model_.variables().joints());
  scale_ = work_.scales.present(report_.energies);
  scale_.force = std::max(scale_.force, terms_.largest_force(state));
  scale_.moment = std::max(scale_.moment, terms_.largest_moment());
  beyond_ = work_.scales.beyond(state);
  report_.max_gradient_scaled = work_.scales.imbalance(free, scale_, options_.tolerance, beyond_);
}

/// Gradient without the parts that constraints and bounds take. @returns the moment of the mean
/// angle's constraint
double NewtonRun::free_gradient(Eigen::VectorXd& free) const {
  free = work_.gradient;
  const double moment = holding_.remove_reactions(free);
  for (const int unknown : bounded_) free[unknown] = 0;
  return moment;
}

void NewtonRun::assemble(const LinkageState& state, Compression compression, WeakHolds holds) {
  // The gradient is known; that with expected tensions is none.
  Eigen::VectorXd& gradient = work_.scratch;
  if (holds == WeakHolds::kAdded && work_.expected && compression == Compression::kBuckles) {
    (void)work_.assembly.hessian(state, gradient, work_.matrix, work_.tensions);
  } else {
    (void)work_.assembly.hessian(state, gradient, work_.matrix, compression);
  }
  terms_.add(state, gradient, work_.matrix);
  if (holds == WeakHolds::kAdded) holding_.add_weak_holds(work_.matrix);
}

void NewtonRun::set_active_bounds(const LinkageState& state) {
  std::vector<int> bounded = lengths_on_their_bound(model_, state, work_.gradient, shortest_);
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

/// By how much the potential may rise: rounding, and the work of closing a gap of rounding.
double NewtonRun::rounding() const {
  const double closing = gap_.size < kSmallGap ? gap_.size : 0;
  return kRelativeRounding * potential_size_ + work_.scales.energy_rounding(beyond_) +
         10 * closing * (scale_.moment + scale_.force * work_.scales.extent());
}

bool NewtonRun::balanced() const {
  return gap_.size <= kGapTolerance && report_.max_gradient_scaled <= options_.tolerance;
}

/// Is there more than rounding in the forces that the tolerance takes for rounding? Short edges are
/// so stiff that rounding of places makes forces in them that are larger than loads elsewhere, but
/// move nothing. In Newton's step for such forces, the gain and the work of the loads are nothing,
/// compared with the work of the loads when they are put on. Unbalanced loads do all of that work.
/// Without loads the elastic energy takes the place of their work.
/// @pre the last factor is that of the state
bool NewtonRun::hides_loads(const LinkageState& state) {
  constexpr double kNothingIsRounding =
      std::numeric_limits<double>::infinity();  // no force is below rounding
  Eigen::VectorXd free;
  (void)free_gradient(free);
  if (!(work_.scales.imbalance(free, scale_, kNothingIsRounding) > options_.tolerance))
    return false;
  Eigen::VectorXd loads = Eigen::VectorXd::Zero(work_.gradient.size());
  terms_.add_gradient(state, loads);
  Eigen::VectorXd step = -work_.gradient;
  for (const int unknown : fixed()) loads[unknown] = step[unknown] = 0;
  const Eigen::VectorXd rows = Eigen::VectorXd::Zero(gap_.rows.size());
  solve(step, rows);
  const double motion = work_.scales.size_of(step).force;  // of lengths, as forces are by them
  if (motion <= kStill * work_.scales.extent() &&
      work_.scales.largest_turn(model_, state, step) <= kStill)
    return false;
  double work = report_.energies.total();
  if (loads.isZero(0)) {
    // Energy of one rod along the whole linkage, bent that little, is no stress.
    const double nothing = work_.scales.bending() / work_.scales.extent() * kNoBend * kNoBend;
    if (work <= nothing) return false;
  } else {
    Eigen::VectorXd moved = loads;
    solve(moved, rows);
    work = std::abs(loads.dot(moved));
  }
  const double left = std::max(std::abs(work_.gradient.dot(step)), std::abs(loads.dot(step)));
  // The part that Newton's steps leave is rounding, if it is not all.
  return !(left <= (hidden_load_checks_ < kHiddenLoadChecks ? kEnergyNoise : kMaxNoise) * work);
}

/// Adds to the lengths on their bound those that a step would shorten at once.
bool NewtonRun::block(const LinkageState& state, const Eigen::VectorXd& x) {
  bool any = false;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const int unknown = model_.variables().joint_begin(j) + kJointLengthA + rod;
      const double least = shortest_ * model_.rest_lengths().terminal(rod, j);
      const double room = state.joints()[j].lengths[rod] - least;
      if (x[unknown] < 0 && room <= -x[unknown] * kShortestFraction &&
          std::find(bounded_.begin(), bounded_.end(), unknown) == bounded_.end()) {
        bounded_.push_back(unknown);
        any = true;
      }
    }
  }
  return any;
}

/// How much of a step keeps the edges of joints long enough.
double NewtonRun::bound_fraction(const LinkageState& state, const Eigen::VectorXd& x) const {
  double fraction = 1;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const double change = x[model_.variables().joint_begin(j) + kJointLengthA + rod];
      const double room =
          state.joints()[j].lengths[rod] - shortest_ * model_.rest_lengths().terminal(rod, j);
      if (change < -room && change < 0)
        fraction = std::min(fraction, std::max(room, 0.0) / -change);
    }
  }
  return fraction;
}

/// Detects short steps where the Hessian is indefinite. The forces do not show the instability,
/// mostly by symmetry, and steps would only creep up to a saddle (the hard case: More, Sorensen
/// 1983).
bool NewtonRun::towards_saddle(const Step& step) const {
  return indefinite_ && !step.prescribed && gap_.size < kSmallGap &&
         report_.max_gradient_scaled < kHard && step.turn < kCreeping * radius_;
}

/// @param linear  the part of the step that Newton's model knows of, if that says what forces to
/// expect after it
void NewtonRun::accept(LinkageState& state, LinkageState next, const Eigen::VectorXd& x,
                       const Eigen::VectorXd& linear) {
  work_.total_increment += x;
  work_.expected = false;
  shown_.reset();
  stable_ = false;
  report_.is_minimum = true;
  std::swap(state, next);
  evaluate(state);
  if (linear.size() == 0 || report_.max_gradient_scaled < kNearSolution) return;
  work_.tensions.expect(model_, next, linear);
  work_.expected = true;
}

}  // namespace limber::rods::detail
