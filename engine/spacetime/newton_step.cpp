#include "engine/spacetime/newton_step.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/constraint_system.h"

namespace limber::spacetime {
namespace {

constexpr int kMaxInner = 60;

}  // namespace

void ConstraintSpace::factor(const ModeSystems& systems, const ConstraintRows& rows,
                             const Lanes& jacobian) {
  jacobian_ = jacobian;
  keyframes_.factor(systems, rows);
  keyframes_.response(systems, rows, jacobian_, system_);
  Eigen::Index at = 0;
  for (const RowBlock& block : rows.position_blocks()) {
    system_.diagonal().segment(at, block.count) +=
        rows.weight().segment(block.first, block.count).cwiseInverse();
    at += block.count;
  }
  factor_lifted(system_, work_);
  ready_ = true;
}

void ConstraintSpace::add_transposed(const ModeSystems& systems, const ConstraintRows& rows,
                                     const Lanes& jacobian, const Eigen::VectorXd& m,
                                     Lanes& out) const {
  for (int row = 0; row < rows.count(); ++row) {
    lane_axpy(m[row], jacobian.col(row).data(),
              out.col(systems.kept_of_knot(rows.knot_of(row))).data(), systems.lanes());
  }
}

void ConstraintSpace::saddle(const ModeSystems& systems, const ConstraintRows& rows, Lanes& r,
                             const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m) {
  const auto along = [&](int row) {
    return lane_dot(jacobian_.col(row).data(),
                    d.col(systems.kept_of_knot(rows.knot_of(row))).data(), systems.lanes());
  };
  const auto push = [&](double force, int row) {
    lane_axpy(force, jacobian_.col(row).data(),
              r.col(systems.kept_of_knot(rows.knot_of(row))).data(), systems.lanes());
  };
  const auto each = [](const std::vector<RowBlock>& blocks, const auto& act) {
    for (const RowBlock& block : blocks) {
      for (int row = block.first; row < block.first + block.count; ++row) act(row);
    }
  };
  const Eigen::VectorXd& weight = rows.weight();
  each(rows.keyframe_blocks(), [&](int row) { push(weight[row] * c[row], row); });
  m.resize(rows.count());
  if (rows.position_count() > 0) {
    d = r;
    keyframes_.solve(systems, d);
    at_positions_.resize(rows.position_count());
    Eigen::Index at = 0;
    each(rows.position_blocks(), [&](int row) { at_positions_[at++] = c[row] - along(row); });
    system_.triangularView<Eigen::Lower>().solveInPlace(at_positions_);
    system_.transpose().triangularView<Eigen::Upper>().solveInPlace(at_positions_);
    at = 0;
    each(rows.position_blocks(), [&](int row) {
      m[row] = at_positions_[at++];
      push(m[row], row);
    });
  }
  d = r;
  keyframes_.solve(systems, d);
  each(rows.keyframe_blocks(), [&](int row) { m[row] = weight[row] * (c[row] - along(row)); });
}

double ConstraintSpace::model_decrement2(const ModeSystems& systems, const ConstraintRows& rows,
                                         const Lanes& d) {
  double sum = 2 * systems.energy(d);
  for (int row = 0; row < rows.count(); ++row) {
    const double along =
        lane_dot(jacobian_.col(row).data(), d.col(systems.kept_of_knot(rows.knot_of(row))).data(),
                 systems.lanes());
    sum += rows.weight()[row] * along * along;
  }
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
  add_transposed(systems, rows, jacobian_, step.m, residual_);
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
    add_transposed(systems, rows, jacobian_, mu_, product_);
    if (!(bend > 1e-14 * square)) break;  // nothing holds this direction
    const double alpha = square / bend;
    step.d += alpha * direction_;
    step.m += alpha * mu_direction_;
    residual_ -= alpha * product_;
  }
  step.decrement2 = model_decrement2(systems, rows, step.d);
}

}  // namespace limber::spacetime
