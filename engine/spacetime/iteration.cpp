#include "engine/spacetime/optimizer.h"

#include <algorithm>
#include <cmath>

#include "engine/base/given_up.h"
#include "engine/spacetime/exact_rows.h"

namespace limber::spacetime {
namespace {

constexpr double kExactWeightGrowth = 10;  // factor of the penalty of exact constraints
constexpr double kExactWeightCap = 1e7;    // its largest value
/// Slow exact rows are met by whole steps if the scaled gradient and their errors [body lengths]
/// are below these ..
constexpr double kNearGradient = 1e-2, kNearTarget = 1e-3;
/// .. to this part of their tolerance, to first order.
constexpr double kExactLeft = 0.1;
/// A Newton step's factor, or its curvature if it was truncated, serves again while steps shrink by
/// at least this.
constexpr double kChordRate = 0.3;
/// Cost of a Newton step in Gauss-Newton steps, with a few of them to go from here to the end.
constexpr double kNewtonCost = 12;
/// A target that moves may end in a worse minimum; this growth of the energy asks for a challenge.
constexpr double kSuspectGrowth = 2;
/// Energies this close (relative) belong to one minimum ...
constexpr double kSameEnergy = 1e-6;
/// ... and an answer that has not converged may be that far from its end.
constexpr double kClearlyBetter = 0.9;

}  // namespace

double Optimizer::take() {
  const double taken = find_trial();
  give_back_multipliers();  // accept() takes as much of new ones as of the step
  if (taken > 0) accept(step_, taken);
  return taken;
}

double Optimizer::find_trial() {
  if (step_.decrement2 <= kRounding * merit(z_, state_)) {
    // The merit cannot tell any more; the decrement can.
    if (lost_ > 0 && step_.decrement2 > 0.25 * lost_) return 0;
    lost_ = step_.decrement2;
    trial_ = z_ + step_.d;
    evaluate(trial_, ConstraintRows::Jacobian::kYes, trial_state_);
    return 1;
  }
  const Search found = search(step_, ConstraintRows::Jacobian::kYes);
  if (full_model() && !chord_) guard_.judge(found.gain, found.taken);
  return found.taken;
}

bool Optimizer::newton_pays(double ratio, double gradient) const {
  if (!(ratio > 0)) return false;
  if (ratio >= 1) return true;
  const double target_reduction = options_.gradient_tolerance / std::max(gradient, 1e-300);
  return std::log(target_reduction) / std::log(ratio) > kNewtonCost;
}

Optimizer::Outcome Optimizer::advance(Course& course) {
  if (course.newton) {
    newton_step();
  } else {
    gauss_newton_step();
  }
  course.gradient = scaled(step_.decrement2);
  if (course.gradient <= options_.gradient_tolerance && exact_done() && guard_.shift() > 0) {
    // A shift shortens steps: the remaining gain is known without it.
    gauss_newton_step();
    course.gradient = scaled(step_.decrement2);
  }
  if (course.gradient <= options_.gradient_tolerance && exact_done()) {
    // The step is there: directions that hardly cost anything gain digits by it.
    if (course.gradient > 0.01 * options_.gradient_tolerance) {
      trial_ = z_ + step_.d;
      evaluate(trial_, ConstraintRows::Jacobian::kYes, trial_state_);
      accept(step_, 1);
    }
    return Outcome::kConverged;
  }
  const double decrement = std::sqrt(step_.decrement2);
  if (exact_slow_ && guard_.shift() == 0 && course.gradient < kNearGradient &&
      max_exact(state_.residual) < kNearTarget)
    meet_exact();
  const double taken = take();
  if (taken == 0) return after_no_decrease(course);
  const bool newton_kind = full_model();
  if (taken < 0.1 && course.gradient > 0.1 && ++course.short_steps >= 3 && !course.ramped) {
    begin_ramp();
    from_rest_ = false;
    course.ramped = true;
    return Outcome::kAgain;
  }
  chord_ = newton_kind && guard_.shift() == 0 && taken == 1 && course.gradient < 0.1 &&
           course.previous > 0 && decrement < kChordRate * course.previous;
  if (!course.newton && course.previous > 0 && !quadratic()) {
    course.newton = taken < 1 || newton_pays(decrement / course.previous, course.gradient);
  }
  if (step_kind_ == StepKind::kTruncated && course.previous > 0)
    slow_truncated_ = decrement < 0.5 * course.previous ? 0 : slow_truncated_ + 1;
  course.previous = decrement;
  if (rows_.exact_count() > 0 && taken == 1 && guard_.shift() == 0) weigh_exact_rows(course);
  newton_last_ = course.newton;
  return Outcome::kMoved;
}

Optimizer::Outcome Optimizer::after_no_decrease(Course& course) {
  if (chord_) {
    chord_ = false;
    return Outcome::kAgain;
  }
  const bool rounding = step_.decrement2 <= kRounding * merit(z_, state_);
  if (course.newton && full_model() && !rounding && guard_.may_retry()) {
    return Outcome::kAgain;  // with the larger shift
  }
  if (rounding && exact_done()) return Outcome::kConverged;
  if (course.newton) return Outcome::kStalled;
  course.newton = true;
  return Outcome::kAgain;
}

void Optimizer::weigh_exact_rows(Course& course) {
  // Multipliers do the work; a heavier weight bends the valley. Only where they are slow.
  const double error = max_exact(state_.residual);
  const bool is_slow = course.exact_before > 0 && error > 0.25 * course.exact_before &&
                       error > options_.constraint_tolerance;
  exact_slow_ = exact_slow_ || (is_slow && rows_.exact_weight() >= kExactWeightCap);
  if (is_slow && rows_.exact_weight() < kExactWeightCap) {
    rows_.set_exact_weight(std::min(kExactWeightCap, kExactWeightGrowth * rows_.exact_weight()));
    space_.invalidate();
    chord_ = false;
  }
  course.exact_before = error;
}

void Optimizer::meet_exact() {
  const Step before = step_;
  RowStep solve;
  if (step_kind_ == StepKind::kNewton) {
    solve = [&](const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m) {
      d.setZero(z_.rows(), z_.cols());
      newton_.saddle(rows_, products(), c, d, m);
    };
  } else if (step_kind_ == StepKind::kGaussNewton) {
    solve = [&](const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m) {
      product_.setZero(z_.rows(), z_.cols());
      space_.saddle(systems_, rows_, product_, c, d, m);
    };
  } else {
    return;
  }
  if (!meet_exact_rows(rows_, products(), state_.residual,
                       kExactLeft * options_.constraint_tolerance, solve, step_)) {
    step_ = before;
    return;
  }
  // With the multipliers as they were the merit is least where the rows are: it has to know first.
  multiplier_before_ = rows_.multiplier();
  rows_.set_multipliers(step_.m);
  rows_.shifted(state_.residual, shifted_);
  descend();
  step_.decrement2 = lane_dot(descent_, step_.d);
  if (step_.decrement2 > 0) return;
  give_back_multipliers();
  rows_.shifted(state_.residual, shifted_);
  step_ = before;
}

void Optimizer::give_back_multipliers() {
  if (multiplier_before_.size() == 0) return;
  rows_.set_multipliers(multiplier_before_);
  multiplier_before_.resize(0);
}

Optimizer::Outcome Optimizer::step_on(Course& course) {
  if (!ramping()) return advance(course);
  ramp_step();
  course.gradient = scaled(step_.decrement2);
  course.previous = 0;
  course.newton = stage_newton_;
  chord_ = false;
  return Outcome::kMoved;
}

SolveReport Optimizer::iterate(const JobContext& job,
                               const std::function<bool(const SolveReport&)>& on_improved) {
  Course course;
  course.newton = newton_last_ && !quadratic();
  course.ramped = ramping();
  curvature_valid_ = chord_ = false;
  lost_ = 0;
  slow_truncated_ = 0;
  exact_slow_ = false;
  for (int iteration = 0;; ++iteration) {
    const auto ended = [&](SolveStatus status) {
      return report(status, iteration, course.gradient);
    };
    if (is_given_up([&] { linearise(); })) return report_given_up(iteration, course.gradient);
    if (job.cancellation.requested()) return ended(SolveStatus::kCancelled);
    if (iteration == options_.max_iterations) return ended(SolveStatus::kIterationLimit);
    Outcome outcome = Outcome::kMoved;
    if (is_given_up([&] { outcome = step_on(course); }))
      return report_given_up(iteration, course.gradient);
    if (outcome == Outcome::kConverged) return ended(SolveStatus::kConverged);
    if (outcome == Outcome::kStalled) return ended(SolveStatus::kStalled);
    if (outcome == Outcome::kAgain) continue;
    if (on_improved &&
        !on_improved(report(SolveStatus::kImproved, iteration + 1, course.gradient))) {
      return report(SolveStatus::kImproved, iteration + 1, course.gradient);
    }
  }
}

SolveReport Optimizer::solve(const JobContext& job,
                             const std::function<bool(const SolveReport&)>& on_improved) {
  if (rows_.count() == 0) return correct();
  const bool cold = ramping() && from_rest_;
  SolveReport answer = iterate(job, on_improved);
  const bool ended =
      answer.status != SolveStatus::kCancelled && answer.status != SolveStatus::kImproved;
  if (!ended) return answer;
  const bool challenged = !cold && !quadratic() &&
                          (needs_check_ || answer.total_energy > kSuspectGrowth * settled_energy_);
  if (challenged) {
    answer = challenge(job, on_improved, answer);
    if (answer.status == SolveStatus::kCancelled || answer.status == SolveStatus::kImproved) {
      needs_check_ = true;
      return answer;
    }
  }
  if (cold || challenged) origins_.clear();
  needs_check_ = from_rest_ = false;
  settled_energy_ = answer.total_energy;
  return answer;
}

SolveReport Optimizer::challenge(const JobContext& job,
                                 const std::function<bool(const SolveReport&)>& on_improved,
                                 SolveReport answer) {
  if (!challenger_) {
    const auto challenger = std::make_shared<Optimizer>(*this);
    if (is_given_up([&] { challenger->cold_start(); })) {
      answer.status = SolveStatus::kImproved;
      return answer;
    }
    challenger_ = challenger;
  }
  bool stopped = false;
  const SolveReport other = challenger_->iterate(job, [&](const SolveReport&) {
    SolveReport known = answer;
    known.status = SolveStatus::kImproved;
    stopped = on_improved && !on_improved(known);
    return !stopped;
  });
  const int iterations = answer.iterations + other.iterations;
  stopped = stopped || other.status == SolveStatus::kImproved;
  if (stopped || other.status == SolveStatus::kCancelled) {
    answer.status = stopped ? SolveStatus::kImproved : SolveStatus::kCancelled;
  } else {
    if (beats(other, answer)) {
      const std::shared_ptr<Optimizer> better = std::move(challenger_);
      *this = std::move(*better);
      answer = other;
    }
    challenger_.reset();
  }
  answer.iterations = iterations;
  return answer;
}

bool Optimizer::beats(const SolveReport& other, const SolveReport& answer) const {
  const double tolerance = options_.constraint_tolerance * length_;
  const double its_error = answer.exact_error(), other_error = other.exact_error();
  if (other_error > std::max(10 * tolerance, 1.1 * its_error)) return false;
  if (its_error > std::max(10 * tolerance, 10 * other_error)) return true;
  const bool converged = answer.status == SolveStatus::kConverged;
  const bool other_converged = other.status == SolveStatus::kConverged;
  if (converged && !other_converged)
    return other.total_energy < kClearlyBetter * answer.total_energy;
  if (!converged && other_converged)
    return other.total_energy < answer.total_energy / kClearlyBetter;
  return other.total_energy < (1 - kSameEnergy) * answer.total_energy;
}

}  // namespace limber::spacetime
