#include "engine/spacetime/optimizer.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

constexpr double kExactWeightStart = 1e4;
constexpr double kExactWeightGrowth = 30;
constexpr double kExactWeightCap = 1e7;
/// A decrease that is smaller than this part of the merit cannot be seen in the merit.
constexpr double kRounding = 1e-12;
/// Gauss-Newton steps whose decrement falls by less than this factor are followed by Newton steps.
constexpr double kSlow = 0.2;

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
}

void Optimizer::cold_start() {
  z_.setZero();
  rows_.forget_multipliers();
  rows_.set_exact_weight(kExactWeightStart);
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  space_.invalidate();
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

Optimizer::Progress Optimizer::search(const Step& step, ConstraintRows::Jacobian wanted,
                                      double& taken) {
  const double start = merit(z_, state_);
  // d merit / dt at 0: force . d - sum w residual' (J d), through the multipliers so that nothing
  // large cancels.
  taken = 1;
  for (int attempt = 0; attempt < 30; ++attempt) {
    trial_ = z_ + taken * step.d;
    evaluate(trial_, attempt == 0 ? wanted : ConstraintRows::Jacobian::kNo, trial_state_);
    const double value = merit(trial_, trial_state_);
    if (value <= start - 1e-4 * taken * step.decrement2) {
      if (attempt > 0 && wanted == ConstraintRows::Jacobian::kYes)
        evaluate(trial_, wanted, trial_state_);
      return Progress::kAccepted;
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

void Optimizer::accept(const Step& step, double taken) {
  z_.swap(trial_);
  std::swap(state_, trial_state_);
  if (rows_.exact_count() > 0) {
    rows_.set_multipliers(rows_.multiplier() + taken * (step.m - rows_.multiplier()));
  }
  motion_valid_ = false;
}

void Optimizer::add_curvature(const Eigen::VectorXd& m, const Lanes& d, Lanes& out) {
  double largest = 0;
  for (const int kept : systems_.knots_kept())
    largest = std::max(largest, d.col(kept).cwiseAbs().maxCoeff());
  if (!(largest > 0)) return;
  const double h = 1e-5 / largest;
  probe_z_ = z_ + h * d;
  evaluate(probe_z_, ConstraintRows::Jacobian::kYes, probe_state_);
  for (int row = 0; row < rows_.count(); ++row) {
    const int kept = systems_.kept_of_knot(rows_.knot_of(row));
    out.col(kept) += m[row] / h * (probe_state_.jacobian.col(row) - state_.jacobian.col(row));
  }
}

SolveReport Optimizer::correct() {
  using Jacobian = ConstraintRows::Jacobian;
  if (rows_.count() == 0) {
    cold_start();
    residual_valid_ = false;
    return report(SolveStatus::kConverged, 0, 0);
  }
  if (!space_.ready()) {
    evaluate(z_, Jacobian::kYes, state_);
    residual_valid_ = jacobian_valid_ = true;
    space_.factor(systems_, rows_, state_.jacobian);
  } else if (!residual_valid_) {
    const bool keep = jacobian_valid_;
    evaluate(z_, Jacobian::kNo, state_);
    residual_valid_ = true;
    jacobian_valid_ = keep;
  }
  systems_.apply(z_, force_);
  rows_.shifted(state_.residual, shifted_);
  space_.quick_step(systems_, rows_, force_, shifted_, step_);
  double taken = 0;
  if (search(step_, Jacobian::kNo, taken) == Progress::kAccepted) {
    accept(step_, taken);
    // The Jacobians in state_ now belong to another z; those of the factor live on in space_.
    jacobian_valid_ = false;
  }
  return report(SolveStatus::kImproved, 1, scaled(step_.decrement2));
}

SolveReport Optimizer::solve(const JobContext& job,
                             const std::function<bool(const SolveReport&)>& on_improved) {
  using Jacobian = ConstraintRows::Jacobian;
  if (rows_.count() == 0) return correct();
  double previous = 0, gradient = 0;
  bool newton = false;
  double lost = 0;  // decrement of the last step that was too small to be judged by the merit
  for (int iteration = 0;; ++iteration) {
    if (job.cancellation.requested()) {
      if (!residual_valid_) evaluate(z_, Jacobian::kNo, state_);
      residual_valid_ = true;
      return report(SolveStatus::kCancelled, iteration, gradient);
    }
    if (!jacobian_valid_ || !residual_valid_) {
      evaluate(z_, Jacobian::kYes, state_);
      jacobian_valid_ = residual_valid_ = true;
    }
    systems_.apply(z_, force_);
    rows_.shifted(state_.residual, shifted_);
    const auto exact_done = [&] {
      return max_exact(state_.residual) <= options_.constraint_tolerance ||
             only_contradiction_left();
    };
    if (space_.ready()) {
      multiplier_ = rows_.weight().cwiseProduct(shifted_);
      gradient = scaled(space_.decrement2(systems_, rows_, force_, state_.jacobian, multiplier_));
      if (gradient <= options_.gradient_tolerance && exact_done()) {
        return report(SolveStatus::kConverged, iteration, gradient);
      }
    }
    if (iteration == options_.max_iterations)
      return report(SolveStatus::kIterationLimit, iteration, gradient);

    space_.factor(systems_, rows_, state_.jacobian);
    Curvature curvature;
    if (newton) {
      space_.quick_step(systems_, rows_, force_, shifted_, step_);
      curvature = [this, m = step_.m](const Lanes& d, Lanes& out) { add_curvature(m, d, out); };
    }
    space_.step(systems_, rows_, force_, shifted_, newton ? 0.1 : 1e-2, curvature, step_);
    gradient = scaled(step_.decrement2);
    if (gradient <= options_.gradient_tolerance && exact_done()) {
      return report(SolveStatus::kConverged, iteration, gradient);
    }
    const double value = merit(z_, state_);
    double taken = 1;
    if (step_.decrement2 <= kRounding * value) {
      // The merit cannot tell any more; the decrement can.
      if (lost > 0 && step_.decrement2 > 0.5 * lost) {
        return report(SolveStatus::kStalled, iteration, gradient);
      }
      lost = step_.decrement2;
      trial_ = z_ + step_.d;
      evaluate(trial_, Jacobian::kYes, trial_state_);
    } else if (search(step_, Jacobian::kYes, taken) == Progress::kNoDecrease) {
      if (!newton) return report(SolveStatus::kStalled, iteration, gradient);
      newton = false;  // once more, the safe way
      previous = 0;
      continue;
    }
    accept(step_, taken);
    const double decrement = std::sqrt(step_.decrement2);
    newton =
        taken == 1 && previous > 0 && decrement > kSlow * previous ? true : newton && taken == 1;
    previous = decrement;
    if (rows_.exact_count() > 0 && taken == 1 && rows_.exact_weight() < kExactWeightCap) {
      rows_.set_exact_weight(std::min(kExactWeightCap, kExactWeightGrowth * rows_.exact_weight()));
      space_.invalidate();
    }
    if (on_improved && !on_improved(report(SolveStatus::kImproved, iteration + 1, gradient))) {
      return report(SolveStatus::kImproved, iteration + 1, gradient);
    }
  }
}

}  // namespace limber::spacetime
