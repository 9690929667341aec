#include "engine/spacetime/optimizer.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

constexpr double kExactWeightStart = 1e4;
constexpr double kExactWeightGrowth = 10;
constexpr double kExactWeightCap = 1e7;
/// A decrease that is smaller than this part of the merit cannot be seen in the merit.
constexpr double kRounding = 1e-12;

/// Continuation: at the first scale the constraints win about this much against the forces ...
constexpr double kRampPull = 0.1;
constexpr double kSmallestScale = 1e-10;
/// ... a stage ends when a step promises less than this part of the merit, or after so many steps.
constexpr double kStageDone = 0.1;
constexpr int kStageSteps = 6;

double inner(const Lanes& a, const Lanes& b) {
  return lane_dot(a.data(), b.data(), static_cast<int>(a.size()));
}

/// A Newton factor serves again while steps shrink by at least this.
constexpr double kChordRate = 0.1;
/// Cost of a Newton step in Gauss-Newton steps, with a few of them to go from here to the end.
constexpr double kNewtonCost = 12;

}  // namespace

Optimizer::Optimizer(std::shared_ptr<const reduced::Kinematics> kinematics,
                     const ModeDynamics& dynamics, const Timeline& timeline,
                     const SolverOptions& options, Eigen::MatrixXd mixing)
    : options_(options),
      length_(kinematics->length()),
      systems_(dynamics, timeline),
      rows_(std::move(kinematics), std::move(mixing), static_cast<int>(dynamics.stiffness.size())) {
  rows_.set_exact_weight(kExactWeightStart);
  motion_.setZero(systems_.modes(), timeline.frame_count);
  motion_valid_ = true;
  set_structure({});
}

void Optimizer::set_structure(const std::map<ConstraintId, PositionConstraint>& constraints) {
  static_cast<void>(motion());
  rows_.rebuild(constraints, systems_.frames().first(), systems_.frames().last());
  if (rows_.knots() != systems_.knots()) {
    systems_.set_knots(rows_.knots());
    systems_.gather(motion_, z_);
  }
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  space_.invalidate();
  if (rows_.count() > 0 && z_.isZero(0)) begin_ramp();
}

void Optimizer::target_moved(const PositionConstraint& constraint) {
  rows_.set_target(constraint);
  residual_valid_ = false;
}

void Optimizer::set_systems(const ModeDynamics& dynamics, const Timeline& timeline,
                            const std::map<ConstraintId, PositionConstraint>& constraints) {
  static_cast<void>(motion());
  systems_ = ModeSystems(dynamics, timeline);
  for (int frame = 0; frame < timeline.frame_count; ++frame) {
    if (!systems_.frames().contains(frame)) motion_.col(frame).setZero();
  }
  rows_.rebuild(constraints, systems_.frames().first(), systems_.frames().last());
  systems_.set_knots(rows_.knots());
  systems_.gather(motion_, z_);
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  space_.invalidate();
  if (rows_.count() > 0 && z_.isZero(0)) begin_ramp();
}

void Optimizer::cold_start() {
  z_.setZero();
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  if (rows_.count() > 0) begin_ramp();
}

const Eigen::MatrixXd& Optimizer::motion() const {
  if (!motion_valid_) {
    systems_.interpolate(z_, motion_);
    motion_valid_ = true;
  }
  return motion_;
}

void Optimizer::evaluate(const Lanes& z, ConstraintRows::Jacobian wanted, RowState& state) const {
  const auto knots = static_cast<Eigen::Index>(rows_.knots().size());
  knots_z_.resize(systems_.lanes(), knots);
  for (Eigen::Index knot = 0; knot < knots; ++knot) {
    knots_z_.col(knot) = z.col(systems_.kept_of_knot(static_cast<int>(knot)));
  }
  rows_.evaluate(knots_z_, wanted, state);
}

void Optimizer::linearise() {
  if (!jacobian_valid_ || !residual_valid_) {
    evaluate(z_, ConstraintRows::Jacobian::kYes, state_);
    jacobian_valid_ = residual_valid_ = true;
  }
  systems_.apply(z_, force_);
  rows_.shifted(state_.residual, shifted_);
}

double Optimizer::merit(const Lanes& z, const RowState& state) const {
  return systems_.energy(z) + rows_.merit(state.residual);
}

double Optimizer::scaled(double decrement2) const {
  if (decrement2 <= 0) return 0;
  const double energy = systems_.energy(z_) + rows_.soft_energy(state_.residual);
  return std::sqrt(decrement2 / (2 * (energy + 1e-6 * rows_.rest_energy())));
}

double Optimizer::max_exact(const Eigen::VectorXd& residual) const {
  double largest = 0;
  for (int row = 0; row < rows_.count(); ++row) {
    if (rows_.exact(row)) largest = std::max(largest, std::abs(residual[row]));
  }
  return largest;
}

bool Optimizer::exact_done() const {
  return max_exact(state_.residual) <= options_.constraint_tolerance || only_contradiction_left();
}

Optimizer::Progress Optimizer::search(const Step& step, ConstraintRows::Jacobian wanted,
                                      double& taken) {
  const double start = merit(z_, state_);
  const auto sufficient = [&](double value) {
    return value <= start - 1e-4 * taken * step.decrement2;
  };
  const auto with_jacobian = [&] {
    if (wanted == ConstraintRows::Jacobian::kYes) evaluate(trial_, wanted, trial_state_);
    return Progress::kAccepted;
  };
  taken = 1;
  for (int attempt = 0; attempt < 30; ++attempt) {
    trial_ = z_ + taken * step.d;
    evaluate(trial_, attempt == 0 ? wanted : ConstraintRows::Jacobian::kNo, trial_state_);
    const double value = merit(trial_, trial_state_);
    if (attempt == 0) {
      if (value <= start - 0.25 * step.decrement2) return Progress::kAccepted;
      // Where heavy constraints bend, a straight step leaves their valley and the merit forbids it:
      // what the rows did that J d did not foresee is taken back (second-order correction, Nocedal
      // and Wright 2006, sec. 18.3).
      if (sufficient(correct_for_curvature(step, value))) return with_jacobian();
    } else if (sufficient(value)) {
      return with_jacobian();
    }
    // The parabola through value and slope at 0 and the value here.
    double next = 0.25 * taken;
    if (std::isfinite(value)) {
      next = taken * taken * step.decrement2 / (2 * (value - start + taken * step.decrement2));
      next = std::clamp(next, 0.1 * taken, 0.5 * taken);
    }
    taken = next;
  }
  return Progress::kNoDecrease;
}

double Optimizer::correct_for_curvature(const Step& step, double value) {
  const auto foreseen = [&](int row) {
    const auto& jacobian = step_kind_ == StepKind::kNewton ? state_.jacobian : space_.jacobian();
    return state_.residual[row] -
           lane_dot(jacobian.col(row).data(),
                    step.d.col(systems_.kept_of_knot(rows_.knot_of(row))).data(), systems_.lanes());
  };
  promised_.resize(rows_.count());
  for (int row = 0; row < rows_.count(); ++row) promised_[row] = foreseen(row);
  double lowest = value;
  for (int round = 0; round < 3 && trial_state_.residual.allFinite(); ++round) {
    surprise_ = trial_state_.residual - promised_;
    if (step_kind_ == StepKind::kNewton) {
      multiplier_ = rows_.weight().cwiseProduct(surprise_);
      correction_.setZero(z_.rows(), z_.cols());
      add_rows(multiplier_, correction_);
      newton_.solve(correction_);
    } else {
      correction_.setZero(z_.rows(), z_.cols());
      product_ = correction_;
      space_.saddle(systems_, rows_, product_, surprise_, correction_, multiplier_);
    }
    candidate_ = trial_ + correction_;
    evaluate(candidate_, ConstraintRows::Jacobian::kNo, candidate_state_);
    const double now = merit(candidate_, candidate_state_);
    if (!(now < lowest)) break;
    lowest = now;
    trial_.swap(candidate_);
    trial_state_.residual.swap(candidate_state_.residual);
  }
  return lowest;
}

void Optimizer::add_rows(const Eigen::VectorXd& m, Lanes& out) const {
  for (int row = 0; row < rows_.count(); ++row) {
    lane_axpy(m[row], state_.jacobian.col(row).data(),
              out.col(systems_.kept_of_knot(rows_.knot_of(row))).data(), systems_.lanes());
  }
}

void Optimizer::accept(const Step& step, double taken) {
  z_.swap(trial_);
  std::swap(state_, trial_state_);
  // On the ramp the exact rows are soft: multipliers would hold them at once.
  if (!ramping()) rows_.set_multipliers(rows_.multiplier() + taken * (step.m - rows_.multiplier()));
  motion_valid_ = false;
}

void Optimizer::set_scale(double scale) {
  rows_.set_scale(scale);
  space_.invalidate();
  stage_steps_ = 0;
  lost_ = 0;
}

void Optimizer::begin_ramp() {
  rows_.forget_multipliers();
  rows_.set_exact_weight(kExactWeightStart);
  set_scale(1);
  linearise();
  // Compliance of a row times its weight: how much the constraint wins against the forces.
  std::vector<double> pulls;
  for (int row = 0; row < rows_.count(); ++row) {
    const int knot = rows_.knot_of(row);
    const double* green = systems_.green(knot, knot);
    double compliance = 0;
    for (int k = 0; k < systems_.lanes(); ++k) {
      const double j = state_.jacobian(k, row);
      compliance += green[k] * j * j;
    }
    pulls.push_back(compliance * rows_.weight()[row]);
  }
  const auto middle = pulls.begin() + static_cast<std::ptrdiff_t>(pulls.size() / 2);
  std::nth_element(pulls.begin(), middle, pulls.end());
  stage_newton_ = false;
  if (*middle > kRampPull) set_scale(std::max(kSmallestScale, kRampPull / *middle));
}

void Optimizer::ramp_step() {
  if (stage_newton_) {
    newton_step();
  } else {
    step_kind_ = StepKind::kGaussNewton;
    space_.factor(systems_, rows_, state_.jacobian);
    space_.quick_step(systems_, rows_, force_, shifted_, step_);
  }
  const double before = merit(z_, state_);
  double taken = 0;
  const bool moved = search(step_, ConstraintRows::Jacobian::kYes, taken) == Progress::kAccepted;
  double gain = 0;
  if (moved) {
    gain = (before - merit(trial_, trial_state_)) / (0.5 * step_.decrement2);
    accept(step_, taken);
  }
  space_.invalidate();
  stage_newton_ = stage_newton_ || gain < 0.5;  // the quadratic model is poor here: the full one
  ++stage_steps_;
  const double promised = std::sqrt(step_.decrement2 / (2 * before));
  if (moved && promised > kStageDone && stage_steps_ < kStageSteps && gain < 0.9) return;
  const bool easy = gain > 0.9 && taken == 1 && stage_steps_ == 1;
  const double growth = easy ? 100 : gain > 0.5 || promised < kStageDone ? 10 : 4;
  set_scale(std::min(1.0, rows_.scale() * growth));
}

void Optimizer::gauss_newton_step() {
  step_kind_ = StepKind::kGaussNewton;
  space_.factor(systems_, rows_, state_.jacobian);
  space_.step(systems_, rows_, force_, shifted_, 1e-2, step_);
}

bool Optimizer::factor_newton() {
  for (int knot = 0; knot < static_cast<int>(rows_.knots().size()); ++knot)
    knots_z_.col(knot) = z_.col(systems_.kept_of_knot(knot));
  // Curvature with the multipliers that a Gauss-Newton step predicts: off the valley of heavy
  // constraints the residuals' own (weight times residual) are far too large.
  space_.factor(systems_, rows_, state_.jacobian);
  space_.quick_step(systems_, rows_, force_, shifted_, step_);
  rows_.curvature(knots_z_, step_.m, curvature_);
  newton_part_ = std::clamp(2 * newton_part_, 0.25, 1.0);
  while (!newton_.factor(systems_, rows_, state_.jacobian, curvature_, newton_part_)) {
    if (newton_part_ == 0) return false;  // weights too far apart for a squared system
    newton_part_ = newton_part_ > 0.1 ? 0.5 * newton_part_ : 0;
  }
  return true;
}

double Optimizer::along(const Lanes& d, int row) const {
  return lane_dot(state_.jacobian.col(row).data(),
                  d.col(systems_.kept_of_knot(rows_.knot_of(row))).data(), systems_.lanes());
}

void Optimizer::apply_newton(const Lanes& d, Lanes& out) {
  systems_.apply(d, out);
  for (int row = 0; row < rows_.count(); ++row) {
    const int kept = systems_.kept_of_knot(rows_.knot_of(row));
    lane_axpy(rows_.weight()[row] * along(d, row), state_.jacobian.col(row).data(),
              out.col(kept).data(), systems_.lanes());
  }
  if (newton_part_ == 0) return;
  for (int knot = 0; knot < static_cast<int>(rows_.knots().size()); ++knot) {
    const int kept = systems_.kept_of_knot(knot);
    out.col(kept).head(systems_.modes()).noalias() -=
        newton_part_ *
        (curvature_[static_cast<std::size_t>(knot)] * d.col(kept).head(systems_.modes()));
  }
}

void Optimizer::newton_step() {
  const bool chord = chord_;  // the last factor still serves: a step for the price of a solve
  if (!chord && !factor_newton()) return gauss_newton_step();
  step_kind_ = StepKind::kNewton;
  multiplier_ = rows_.weight().cwiseProduct(shifted_);
  descent_ = -force_;
  add_rows(multiplier_, descent_);
  step_.d = descent_;
  newton_.solve(step_.d);
  if (!chord) refine_newton_step();
  step_.decrement2 = std::max(0.0, inner(descent_, step_.d));
  step_.m.resize(rows_.count());
  for (int row = 0; row < rows_.count(); ++row) {
    step_.m[row] = multiplier_[row] - rows_.weight()[row] * along(step_.d, row);
  }
}

void Optimizer::refine_newton_step() {
  // Conjugate gradients take the proximal term out. It shows for free ends and at resonance only.
  double before = inner(descent_, step_.d);
  const double enough = 1e-8 * before;
  direction_ = step_.d;
  step_.d.setZero();
  left_ = descent_;
  for (int round = 0; round < 30; ++round) {
    apply_newton(direction_, product_);
    const double bend = inner(direction_, product_);
    if (!(bend > 1e-14 * before)) break;
    step_.d += before / bend * direction_;
    left_ -= before / bend * product_;
    if (!(left_.squaredNorm() > 1e-10 * descent_.squaredNorm())) break;
    preconditioned_ = left_;
    newton_.solve(preconditioned_);
    const double square = inner(left_, preconditioned_);
    if (!(square > enough)) break;
    direction_ = preconditioned_ + square / before * direction_;
    before = square;
  }
}

bool Optimizer::take(double& taken) {
  taken = 1;
  if (step_.decrement2 <= kRounding * merit(z_, state_)) {
    // The merit cannot tell any more; the decrement can.
    if (lost_ > 0 && step_.decrement2 > 0.25 * lost_) return false;
    lost_ = step_.decrement2;
    trial_ = z_ + step_.d;
    evaluate(trial_, ConstraintRows::Jacobian::kYes, trial_state_);
  } else if (search(step_, ConstraintRows::Jacobian::kYes, taken) == Progress::kNoDecrease) {
    return false;
  }
  accept(step_, taken);
  return true;
}

bool Optimizer::newton_pays(double ratio, double gradient) const {
  if (!(ratio > 0)) return false;
  if (ratio >= 1) return true;
  const double wanted = options_.gradient_tolerance / std::max(gradient, 1e-300);
  return std::log(wanted) / std::log(ratio) > kNewtonCost;
}

SolveReport Optimizer::correct() {
  using Jacobian = ConstraintRows::Jacobian;
  if (rows_.count() == 0) {
    cold_start();
    residual_valid_ = false;
    return report(SolveStatus::kConverged, 0, 0);
  }
  if (!ramping()) {
    if (!space_.ready()) {
      linearise();
      space_.factor(systems_, rows_, state_.jacobian);
    } else if (!residual_valid_) {
      const bool keep = jacobian_valid_;
      evaluate(z_, Jacobian::kNo, state_);
      residual_valid_ = true;
      jacobian_valid_ = keep;
    }
    systems_.apply(z_, force_);
    rows_.shifted(state_.residual, shifted_);
    step_kind_ = StepKind::kGaussNewton;
    space_.quick_step(systems_, rows_, force_, shifted_, step_);
    double taken = 0;
    if (search(step_, Jacobian::kNo, taken) == Progress::kAccepted) {
      accept(step_, taken);
      // The Jacobians in state_ now belong to another z; those of the factor live on in space_.
      jacobian_valid_ = false;
    }
    return report(SolveStatus::kImproved, 1, scaled(step_.decrement2));
  }
  linearise();
  ramp_step();
  return report(SolveStatus::kImproved, 1, scaled(step_.decrement2));
}

SolveReport Optimizer::solve(const JobContext& job,
                             const std::function<bool(const SolveReport&)>& on_improved) {
  if (rows_.count() == 0) return correct();
  double previous = 0, gradient = 0;
  bool newton = newton_last_, ramped = ramping();
  chord_ = false;
  int short_steps = 0;
  double exact_before = 0;
  lost_ = 0;
  for (int iteration = 0;; ++iteration) {
    if (job.cancellation.requested()) {
      linearise();
      return report(SolveStatus::kCancelled, iteration, gradient);
    }
    linearise();
    if (iteration == options_.max_iterations)
      return report(SolveStatus::kIterationLimit, iteration, gradient);
    if (ramping()) {
      ramp_step();
      gradient = scaled(step_.decrement2);
      previous = 0;
      newton = stage_newton_;
      chord_ = false;
    } else {
      if (newton) {
        newton_step();
      } else {
        gauss_newton_step();
      }
      gradient = scaled(step_.decrement2);
      if (gradient <= options_.gradient_tolerance && exact_done()) {
        // The step is there: directions that hardly cost anything gain digits by it.
        if (gradient > 0.01 * options_.gradient_tolerance) {
          trial_ = z_ + step_.d;
          evaluate(trial_, ConstraintRows::Jacobian::kYes, trial_state_);
          accept(step_, 1);
        }
        return report(SolveStatus::kConverged, iteration, gradient);
      }
      const bool rounding = step_.decrement2 <= kRounding * merit(z_, state_);
      double taken = 1;
      if (!take(taken)) {
        if (chord_) {
          chord_ = false;
          continue;
        }
        if (rounding && exact_done()) return report(SolveStatus::kConverged, iteration, gradient);
        if (newton) return report(SolveStatus::kStalled, iteration, gradient);
        newton = true;
        continue;
      }
      if (taken < 0.1 && gradient > 0.1 && ++short_steps >= 3 && !ramped) {
        begin_ramp();
        ramped = true;
        continue;
      }
      const double decrement = std::sqrt(step_.decrement2);
      chord_ = step_kind_ == StepKind::kNewton && taken == 1 && gradient < 0.1 && previous > 0 &&
               decrement < kChordRate * previous;
      if (!newton && previous > 0)
        newton = taken < 1 || newton_pays(decrement / previous, gradient);
      previous = decrement;
      if (rows_.exact_count() > 0 && taken == 1) {
        // Multipliers do the work; a heavier weight bends the valley. Only where they are slow.
        const double error = max_exact(state_.residual);
        if (exact_before > 0 && error > 0.25 * exact_before &&
            error > options_.constraint_tolerance && rows_.exact_weight() < kExactWeightCap) {
          rows_.set_exact_weight(
              std::min(kExactWeightCap, kExactWeightGrowth * rows_.exact_weight()));
          space_.invalidate();
          chord_ = false;
        }
        exact_before = error;
      }
      newton_last_ = newton;
    }
    if (on_improved && !on_improved(report(SolveStatus::kImproved, iteration + 1, gradient))) {
      return report(SolveStatus::kImproved, iteration + 1, gradient);
    }
  }
}

}  // namespace limber::spacetime
