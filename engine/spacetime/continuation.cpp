#include "engine/spacetime/optimizer.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace limber::spacetime {
namespace {

/// At the first scale the constraints win about this much against the forces ...
constexpr double kRampPull = 0.1;
constexpr double kSmallestScale = 1e-10;  // of the constraints at the start of the ramp
/// ... a stage ends when a step promises less than this part of the merit, or after so many steps.
constexpr double kStageDone = 0.1;
constexpr int kStageSteps = 6;  // of one stage at most

}  // namespace

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
  stage_newton_ = false;
  guard_.reset();
  // Keyframes are linear in z: they need no continuation.
  if (rows_.position_rows().empty()) return;
  // Compliance of a row times its weight: how much the constraint wins against the forces.
  const bool only_diagonal = !rows_.keyframe_blocks().empty() && rows_.pairs().empty();
  Eigen::VectorXd own;
  std::vector<double> pulls(static_cast<std::size_t>(rows_.count()), 0.0);
  const auto add = [&](int term, int other, double times, const double* response) {
    double compliance = 0;
    for (int k = 0; k < systems_.lanes(); ++k)
      compliance += response[k] * state_.jacobian(k, term) * state_.jacobian(k, other);
    const int row = rows_.row_of(term);
    pulls[static_cast<std::size_t>(row)] += times * compliance * rows_.weight()[row];
  };
  for (int knot = 0; knot < static_cast<int>(rows_.knots().size()); ++knot) {
    if (only_diagonal) systems_.response(knot, own);
    const double* response = only_diagonal ? own.data() : systems_.green()(knot, knot);
    for (int term = rows_.first_term(knot); term < rows_.first_term(knot + 1); ++term)
      add(term, term, 1, response);
  }
  for (const TermPair& pair : rows_.pairs()) {
    const int knot = rows_.knot_of(pair.first), other = rows_.knot_of(pair.second);
    add(pair.first, pair.second, 2, systems_.green()(knot, other));
  }
  const auto middle = pulls.begin() + static_cast<std::ptrdiff_t>(pulls.size() / 2);
  std::nth_element(pulls.begin(), middle, pulls.end());
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
  const auto [taken, before, gain] = search(step_, ConstraintRows::Jacobian::kYes);
  if (taken > 0) accept(step_, taken);
  if (full_model()) guard_.judge(gain, taken);
  space_.invalidate();
  stage_newton_ = stage_newton_ || gain < 0.5;  // the quadratic model is poor here: the full one
  ++stage_steps_;
  const double promised = std::sqrt(step_.decrement2 / (2 * before));
  if (taken > 0 && promised > kStageDone && stage_steps_ < kStageSteps && gain < 0.9) return;
  const bool easy = gain > 0.9 && taken == 1 && stage_steps_ == 1;
  const double growth = easy ? 100 : gain > 0.5 || promised < kStageDone ? 10 : 4;
  set_scale(std::min(1.0, rows_.scale() * growth));
}

}  // namespace limber::spacetime
