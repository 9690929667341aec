#include "engine/spacetime/optimizer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/numerics/line_search.h"
#include "engine/base/start_shift.h"

namespace limber::spacetime {
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

void Optimizer::set_structure(const ConstraintSet& constraints) {
  static_cast<void>(motion());
  rows_.rebuild(constraints, systems_.frames());
  if (rows_.knots() != systems_.knots()) {
    systems_.set_knots(rows_.knots());
    take_up(motion_);
  }
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  space_.forget();
  needs_check_ = true;
  challenger_.reset();
  start_from_rest_if_there();
}

void Optimizer::target_moved(const PositionConstraint& constraint, const Eigen::Vector3d& from) {
  rows_.set_target(constraint);
  const Eigen::Vector3d& origin = origins_.try_emplace(constraint.id, from).first->second;
  const double frames = constraint.is_velocity() ? kTravelFrames : 1;
  needs_check_ =
      needs_check_ || frames * (constraint.target - origin).norm() > kFarTravel * length_;
  challenger_.reset();
  residual_valid_ = false;
}

void Optimizer::set_systems(const ModeDynamics& dynamics, const Timeline& timeline,
                            const ConstraintSet& constraints) {
  static_cast<void>(motion());
  const bool is_passive = z_.isZero(0);
  systems_ = ModeSystems(dynamics, timeline);
  passive_ = load_.size() > 0 ? passive_motion(dynamics, timeline, load_) : PassiveMotion{};
  for (int frame = 0; frame < timeline.frame_count; ++frame) {
    if (!systems_.frames().contains(frame)) motion_.col(frame).setZero();
  }
  rows_.rebuild(constraints, systems_.frames());
  systems_.set_knots(rows_.knots());
  take_up(motion_);
  if (is_passive) z_.setZero();
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  space_.forget();
  needs_check_ = true;
  challenger_.reset();
  start_from_rest_if_there();
}

void Optimizer::set_material(const ModeDynamics& dynamics, Eigen::MatrixXd mixing,
                             const Timeline& timeline, const ConstraintSet& constraints) {
  rows_.set_mixing(std::move(mixing));
  set_systems(dynamics, timeline, constraints);
}

void Optimizer::cold_start() {
  challenger_.reset();
  z_.setZero();
  residual_valid_ = jacobian_valid_ = motion_valid_ = false;
  start_from_rest_if_there();
}

void Optimizer::start_from_rest_if_there() {
  // A ramp that another set of constraints began is as good as any warm start, not a cold one.
  from_rest_ = rows_.count() > 0 && z_.isZero(0);
  if (from_rest_) begin_ramp();
}

/// Left on the ramp, it would be led away again by weights that hardly pull.
void Optimizer::warm_start(const Eigen::MatrixXd& motion, Known known) {
  challenger_.reset();
  // The motion that is there already, after the kinematics changed: its frames need not be found
  // again from the kept ones.
  bool is_interpolated = motion_valid_ && &motion == &motion_;
  if (start_shift() > 0 && known == Known::kGuess && motion.size() > 0) {
    const Eigen::MatrixXd moves = (start_moves(motion.size()) * motion.cwiseAbs().maxCoeff())
                                      .reshaped(motion.rows(), motion.cols());
    take_up(motion + moves);
    is_interpolated = false;
  } else {
    take_up(motion);
  }
  residual_valid_ = jacobian_valid_ = curvature_valid_ = false;
  motion_valid_ = is_interpolated;
  rows_.forget_multipliers();
  set_scale(1);
  from_rest_ = false;
  if (known == Known::kGuess) return;
  needs_check_ = false;
  origins_.clear();
  settled_energy_ = std::numeric_limits<double>::infinity();  // set by the next solve
}

const Eigen::MatrixXd& Optimizer::motion() const {
  if (!motion_valid_) {
    systems_.interpolate(z_, motion_);
    if (passive_.z.size() > 0) motion_ += passive_.z;
    motion_valid_ = true;
  }
  return motion_;
}

Eigen::MatrixXd Optimizer::motion_in(FrameSpan frames) const {
  if (motion_valid_) return motion_.middleCols(frames.first, frames.count);
  Eigen::MatrixXd part = systems_.interpolate(z_, frames);
  if (passive_.z.size() > 0) part += passive_.z.middleCols(frames.first, frames.count);
  return part;
}

void Optimizer::take_up(const Eigen::MatrixXd& motion) {
  if (passive_.z.size() == 0) return systems_.gather(motion, z_);
  systems_.gather(motion - passive_.z, z_);
}

void Optimizer::set_load(Eigen::MatrixXd load, const ModeDynamics& dynamics,
                         const Timeline& timeline, const ConstraintSet& constraints) {
  load_ = std::move(load);
  set_systems(dynamics, timeline, constraints);
}

void Optimizer::gather_knots(const Lanes& z) const {
  const auto knots = static_cast<Eigen::Index>(rows_.knots().size());
  knots_z_.resize(systems_.lanes(), knots);
  for (Eigen::Index knot = 0; knot < knots; ++knot) {
    knots_z_.col(knot) = z.col(systems_.kept_of_knot(static_cast<int>(knot)));
    if (passive_.z.size() == 0) continue;
    knots_z_.col(knot).head(systems_.modes()) +=
        passive_.z.col(rows_.knots()[static_cast<std::size_t>(knot)]);
  }
}

void Optimizer::evaluate(const Lanes& z, ConstraintRows::Jacobian jacobian, RowState& state) const {
  gather_knots(z);
  rows_.evaluate(knots_z_, jacobian, state);
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

Optimizer::Search Optimizer::search(const Step& step, ConstraintRows::Jacobian jacobian) {
  const double start = merit(z_, state_);
  const SufficientDecrease decrease{start, -step.decrement2};
  double reached = start;
  bool has_jacobian = false;
  const auto attempt = [&](double part) {
    const bool is_full = part == 1;
    trial_ = z_ + part * step.d;
    evaluate(trial_, is_full ? jacobian : ConstraintRows::Jacobian::kNo, trial_state_);
    const double value = merit(trial_, trial_state_);
    reached = value;
    if (is_full) {
      has_jacobian = value <= start - 0.25 * step.decrement2;
      if (has_jacobian) return StepVerdict::accept();
      // If heavy constraints bend, a straight step leaves their valley and the merit forbids it.
      // The change of the rows beyond J d is taken back (second-order correction, Nocedal and
      // Wright 2006, sec. 18.3).
      reached = correct_for_curvature(step, value);
    }
    return decrease.accepts(part, reached) ? StepVerdict::accept()
                                           : StepVerdict::retry(decrease.shorter(part, value));
  };
  const int attempts = full_model() ? guard_.attempts() : 30;
  const BacktrackReport found = backtrack({.max_trials = attempts}, attempt);
  if (!found.is_accepted) return {0, start, 0};
  if (jacobian == ConstraintRows::Jacobian::kYes && !has_jacobian)
    evaluate(trial_, jacobian, trial_state_);
  return {found.step, start, (start - reached) / (0.5 * step.decrement2)};
}

double Optimizer::correct_for_curvature(const Step& step, double value) {
  const auto& jacobian = step_kind_ == StepKind::kNewton ? state_.jacobian : space_.jacobian();
  RowProducts{systems_, rows_, jacobian}.multiply(step.d, along_);
  promised_ = state_.residual - along_;
  double lowest = value;
  for (int round = 0; round < 3 && trial_state_.residual.allFinite(); ++round) {
    surprise_ = trial_state_.residual - promised_;
    if (step_kind_ == StepKind::kNewton) {
      multiplier_ = rows_.weight().cwiseProduct(surprise_);
      correction_.setZero(z_.rows(), z_.cols());
      products().add_transposed(multiplier_, correction_);
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

void Optimizer::accept(const Step& step, double taken) {
  z_.swap(trial_);
  std::swap(state_, trial_state_);
  // On the ramp the exact rows are soft: multipliers would hold them at once.
  if (!ramping()) rows_.set_multipliers(rows_.multiplier() + taken * (step.m - rows_.multiplier()));
  motion_valid_ = curvature_valid_ = false;
}

void Optimizer::gauss_newton_step() {
  step_kind_ = StepKind::kGaussNewton;
  space_.factor(systems_, rows_, state_.jacobian);
  space_.step(systems_, rows_, force_, shifted_, 1e-2, step_);
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
    if (const Search found = search(step_, Jacobian::kNo); found.taken > 0) {
      accept(step_, found.taken);
      // The Jacobians in state_ now belong to another z; those of the factor live on in space_.
      jacobian_valid_ = false;
    }
    return report(SolveStatus::kImproved, 1, scaled(step_.decrement2));
  }
  linearise();
  ramp_step();
  return report(SolveStatus::kImproved, 1, scaled(step_.decrement2));
}

}  // namespace limber::spacetime
