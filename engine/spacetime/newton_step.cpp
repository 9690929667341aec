#include "engine/spacetime/newton_step.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/constraint_system.h"
#include "engine/spacetime/row_products.h"

namespace limber::spacetime {
namespace {

constexpr int kMaxInner = 60;  // conjugate gradient iterations at most
/// Multipliers W (c - J d) lose digits with heavier rows.
constexpr double kHeaviestByFrames = 1e8;

/// The form of fewer operations. C takes n^2 r for its entries and n^3 / 3 for its factor. Groups
/// of s r, s frames that couple to the next alone, take 7/3 (s r)^3 each.
ConstraintSpace::Form cheaper_form(const ModeSystems& systems, const ConstraintRows& rows) {
  if (rows.count() > 0 && rows.weight().maxCoeff() > kHeaviestByFrames)
    return ConstraintSpace::Form::kRows;
  const auto n = static_cast<double>(rows.position_places().size());
  const double r = systems.modes(), group = systems.width() / 2.0;
  const double by_rows = n * n * (r + n / 3);
  const double by_frames = 7.0 / 3 * group * group * r * r * r * systems.kept_count();
  return by_frames < by_rows ? ConstraintSpace::Form::kFrames : ConstraintSpace::Form::kRows;
}

}  // namespace

void ConstraintSpace::factor(const ModeSystems& systems, const ConstraintRows& rows,
                             const Lanes& jacobian) {
  factor(systems, rows, jacobian, cheaper_form(systems, rows));
}

void ConstraintSpace::factor(const ModeSystems& systems, const ConstraintRows& rows,
                             const Lanes& jacobian, Form form) {
  jacobian_ = jacobian;
  form_ = form;
  if (form == Form::kFrames && frames_.factor_first_order(systems, rows, jacobian_)) {
    ready_ = true;
    return;
  }
  form_ = Form::kRows;
  keyframes_.factor(systems, rows);
  keyframes_.response(systems, rows, jacobian_, system_);
  Eigen::Index at = 0;
  for (const int row : rows.position_rows()) system_.diagonal()[at++] += 1 / rows.weight()[row];
  factor_lifted(system_, work_);
  ready_ = true;
}

void ConstraintSpace::saddle(const ModeSystems& systems, const ConstraintRows& rows, Lanes& r,
                             const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m) {
  const RowProducts j{systems, rows, jacobian_};
  if (form_ == Form::kFrames) {
    d = r;
    return frames_.saddle(rows, j, c, d, m);
  }
  const Eigen::VectorXd& weight = rows.weight();
  m = weight.cwiseProduct(c);
  j.add_transposed(rows.keyframe_blocks(), m, r);
  if (!rows.position_rows().empty()) {
    d = r;
    keyframes_.solve(systems, d);
    along_.setZero(rows.count());
    j.add_product(rows.position_blocks(), d, along_);
    at_positions_.resize(static_cast<Eigen::Index>(rows.position_rows().size()));
    Eigen::Index at = 0;
    for (const int row : rows.position_rows()) at_positions_[at++] = c[row] - along_[row];
    system_.triangularView<Eigen::Lower>().solveInPlace(at_positions_);
    system_.transpose().triangularView<Eigen::Upper>().solveInPlace(at_positions_);
    at = 0;
    for (const int row : rows.position_rows()) m[row] = at_positions_[at++];
    j.add_transposed(rows.position_blocks(), m, r);
  }
  d = r;
  keyframes_.solve(systems, d);
  if (rows.keyframe_blocks().empty()) return;
  along_.setZero(rows.count());
  j.add_product(rows.keyframe_blocks(), d, along_);
  for (const TermBlock& block : rows.keyframe_blocks()) {
    for (int term = block.first; term < block.first + block.count; ++term) {
      const int row = rows.row_of(term);
      m[row] = weight[row] * (c[row] - along_[row]);
    }
  }
}

double ConstraintSpace::model_decrement2(const ModeSystems& systems, const ConstraintRows& rows,
                                         const Lanes& d) {
  double sum = 2 * systems.energy(d);
  RowProducts{systems, rows, jacobian_}.multiply(d, along_);
  for (int row = 0; row < rows.count(); ++row)
    sum += rows.weight()[row] * along_[row] * along_[row];
  return sum;
}

void ConstraintSpace::quick_step(const ModeSystems& systems, const ConstraintRows& rows,
                                 const Lanes& force, const Eigen::VectorXd& residual, Step& step) {
  LIMBER_DEMAND(ready_);
  residual_ = -force;
  saddle(systems, rows, residual_, residual, step.d, step.m);
  step.decrement2 = model_decrement2(systems, rows, step.d);
}

void ConstraintSpace::step(const ModeSystems& systems, const ConstraintRows& rows,
                           const Lanes& force, const Eigen::VectorXd& residual, double tolerance,
                           Step& step) {
  quick_step(systems, rows, force, residual, step);
  refine(systems, rows, force, tolerance, step);
}

void ConstraintSpace::refine(const ModeSystems& systems, const ConstraintRows& rows,
                             const Lanes& force, double tolerance, Step& step) {
  zero_.setZero(rows.count());
  // r = J^T m - K (z + d), in which only the proximal term is left.
  systems.apply(step.d, product_);
  residual_ = -force - product_;
  const RowProducts j{systems, rows, jacobian_};
  j.add_transposed(step.m, residual_);
  double before = 0;
  const double target = tolerance * tolerance * step.decrement2;
  for (int iteration = 0; iteration < kMaxInner; ++iteration) {
    work_ = residual_;
    saddle(systems, rows, work_, zero_, x_, mu_);
    const double square = lane_dot(residual_, x_);
    if (!(square > target) || (iteration > 0 && square > 1e6 * before)) break;
    if (iteration == 0) {
      direction_ = x_;
      mu_direction_ = mu_;
    } else {
      const double beta = square / before;
      direction_ = x_ + beta * direction_;
      mu_direction_ = mu_ + beta * mu_direction_;
    }
    before = square;
    systems.apply(direction_, product_);
    double bend = lane_dot(direction_, product_);
    for (int row = 0; row < rows.count(); ++row)
      bend += mu_direction_[row] * mu_direction_[row] / rows.weight()[row];
    mu_ = -mu_direction_;
    j.add_transposed(mu_, product_);
    if (!(bend > 1e-14 * square)) break;  // nothing holds this direction
    const double alpha = square / bend;
    step.d += alpha * direction_;
    step.m += alpha * mu_direction_;
    residual_ -= alpha * product_;
  }
  step.decrement2 = model_decrement2(systems, rows, step.d);
}

}  // namespace limber::spacetime
