#include "engine/spacetime/optimizer.h"

#include <algorithm>
#include <cmath>

namespace limber::spacetime {
namespace {

/// A truncated step ends with this part of its first residual ...
constexpr double kTruncatedLeft = 1e-2;
/// ... or is left to the factored system after this many rounds.
constexpr int kTruncatedRounds = 40;
/// Far out most of their work is spent on directions that a factor finds to have no minimum: they
/// serve where the scaled gradient is below this.
constexpr double kMaxTruncatedGradient = 0.3;
/// They do not see a saddle that they stand on, a factor does: it looks after so many steps in a
/// row that hardly shrink.
constexpr int kSlowTruncated = 3;

}  // namespace

void Optimizer::update_curvature() {
  if (curvature_valid_) return;
  gather_knots(z_);
  // Curvature with the multipliers that a Gauss-Newton step predicts: off the valley of heavy
  // constraints the residuals' own (weight times residual) are far too large.
  space_.factor(systems_, rows_, state_.jacobian);
  space_.quick_step(systems_, rows_, force_, shifted_, step_);
  rows_.curvature(knots_z_, step_.m, curvature_);
  double largest = 0;
  for (const auto& block : curvature_) largest = std::max(largest, block.norm());
  guard_.set_curvature(largest);
  curvature_valid_ = true;
}

bool Optimizer::factor_newton() {
  update_curvature();
  while (!newton_.factor(systems_, rows_, state_.jacobian, curvature_, guard_)) {
    if (!guard_.strengthen()) return false;
  }
  return true;
}

void Optimizer::apply_newton(const Lanes& d, Lanes& out) {
  systems_.apply(d, out);
  products().multiply(d, along_);
  along_.array() *= rows_.weight().array();
  products().add_transposed(along_, out);
  for (int knot = 0; knot < static_cast<int>(rows_.knots().size()); ++knot) {
    const int kept = systems_.kept_of_knot(knot);
    out.col(kept).head(systems_.modes()).noalias() -=
        guard_.part() *
        (curvature_[static_cast<std::size_t>(knot)] * d.col(kept).head(systems_.modes()));
    out.col(kept) += guard_.shift() * d.col(kept);
  }
}

void Optimizer::newton_step() {
  // A factor serves again, or the curvature of a truncated step.
  const bool chord = chord_ && step_kind_ == StepKind::kNewton;
  if (!chord && guard_.idle() && slow_truncated_ < kSlowTruncated && !exact_slow_) {
    if (truncated_newton_step(chord_ ? Curvature::kLent : Curvature::kOwn)) return;
    chord_ = false;
  }
  if (!chord && !factor_newton()) return gauss_newton_step();
  step_kind_ = StepKind::kNewton;
  descend();
  step_.d = descent_;
  newton_.solve(step_.d);
  if (!chord) refine_newton_step();
  finish_newton_step();
}

void Optimizer::descend() {
  multiplier_ = rows_.weight().cwiseProduct(shifted_);
  descent_ = -force_;
  products().add_transposed(multiplier_, descent_);
}

void Optimizer::finish_newton_step() {
  step_.decrement2 = std::max(0.0, lane_dot(descent_, step_.d));
  if (guard_.shift() > 0) {
    step_.m = rows_.multiplier();  // what a shortened step leaves undone is no multiplier
    return;
  }
  products().multiply(step_.d, along_);
  step_.m = multiplier_ - rows_.weight().cwiseProduct(along_);
}

bool Optimizer::truncated_newton_step(Curvature curvature) {
  if (curvature == Curvature::kLent) {
    space_.factor(systems_, rows_, state_.jacobian);
  } else {
    update_curvature();
    if (scaled(step_.decrement2) > kMaxTruncatedGradient) return false;
  }
  descend();
  step_.d.setZero(z_.rows(), z_.cols());
  left_ = descent_;
  no_rows_.setZero(rows_.count());
  double before = 0, first = 0;
  for (int round = 0; round < kTruncatedRounds; ++round) {
    product_ = left_;
    space_.saddle(systems_, rows_, product_, no_rows_, preconditioned_, multiplier_left_);
    const double square = lane_dot(left_, preconditioned_);
    if (round == 0) {
      first = square;
      direction_ = preconditioned_;
    } else {
      if (square <= kTruncatedLeft * kTruncatedLeft * first) {
        step_kind_ = StepKind::kTruncated;
        finish_newton_step();
        return true;
      }
      direction_ = preconditioned_ + square / before * direction_;
    }
    if (!(square > 0)) return false;
    before = square;
    apply_newton(direction_, product_);
    const double bend = lane_dot(direction_, product_);
    if (!(bend > 1e-14 * square)) return false;
    step_.d += square / bend * direction_;
    left_ -= square / bend * product_;
  }
  return false;
}

void Optimizer::refine_newton_step() {
  // Conjugate gradients take the proximal term out. It shows for free ends and at resonance only.
  double before = lane_dot(descent_, step_.d);
  const double enough = 1e-8 * before;
  direction_ = step_.d;
  step_.d.setZero();
  left_ = descent_;
  for (int round = 0; round < 30; ++round) {
    apply_newton(direction_, product_);
    const double bend = lane_dot(direction_, product_);
    if (!(bend > 1e-14 * before)) {
      // No minimum of the true model along here: the proximal step itself still descends.
      if (round == 0) step_.d = direction_;
      break;
    }
    step_.d += before / bend * direction_;
    left_ -= before / bend * product_;
    if (!(left_.squaredNorm() > 1e-10 * descent_.squaredNorm())) break;
    preconditioned_ = left_;
    newton_.solve(preconditioned_);
    const double square = lane_dot(left_, preconditioned_);
    if (!(square > enough)) break;
    direction_ = preconditioned_ + square / before * direction_;
    before = square;
  }
}

}  // namespace limber::spacetime
