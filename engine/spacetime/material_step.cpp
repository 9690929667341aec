#include "engine/spacetime/material_step.h"

#include <cmath>

#include "engine/spacetime/constraint_system.h"
#include "engine/spacetime/material.h"
#include "engine/spacetime/row_products.h"

namespace limber::spacetime {
namespace {

/// A step in S moves the rows of keyframes too: all rows stay in C.
std::vector<TermBlock> all_terms(const ConstraintRows& rows) {
  std::vector<TermBlock> blocks;
  for (int knot = 0; knot < static_cast<int>(rows.knots().size()); ++knot) {
    const int first = rows.first_term(knot);
    blocks.push_back({knot, first, rows.first_term(knot + 1) - first});
  }
  return blocks;
}

std::vector<int> rows_of_terms(const ConstraintRows& rows) {
  std::vector<int> of(static_cast<std::size_t>(rows.term_count()));
  for (int term = 0; term < rows.term_count(); ++term)
    of[static_cast<std::size_t>(term)] = rows.row_of(term);
  return of;
}

}  // namespace

void MaterialSpace::factor(const ModeSystems& systems, const ConstraintRows& rows,
                           const MaterialPoint& point, const Damping& damping) {
  const Eigen::Index n = rows.term_count();
  const Eigen::Index modes = systems.modes(), coordinates = point.mixing.rows();
  const Eigen::Index held = damping.held;
  damping_ = damping;
  hat_ = point.rows.jacobian.topRows(coordinates);
  mixing_ = point.mixing;
  jacobian_.setZero(systems.lanes(), n);
  jacobian_.topRows(modes).noalias() = mixing_.transpose() * hat_;

  response_of_terms(systems.green(), all_terms(rows), jacobian_, scaled_, system_);
  if (std::isfinite(damping.nu)) {
    const Eigen::Index moved = modes - held;
    at_terms_.resize(moved, n);
    for (int term = 0; term < rows.term_count(); ++term) {
      at_terms_.col(term) =
          point.z.col(systems.kept_of_knot(rows.knot_of(term))).segment(held, moved);
    }
    shrink_ =
        (8 * damping.mu /
         (damping.nu + 8 * damping.mu * mixing_.rightCols(moved).colwise().squaredNorm().array()))
            .matrix();
    free_hat_ = hat_.bottomRows(coordinates - held);
    work_.noalias() = free_hat_.transpose() * free_hat_;
    weighted_.noalias() = at_terms_.transpose() * at_terms_;
    system_.triangularView<Eigen::Lower>() += work_.cwiseProduct(weighted_) / damping.nu;
    const Eigen::MatrixXd pulled = at_terms_.cwiseProduct(jacobian_.middleRows(held, moved));
    weighted_ = shrink_.asDiagonal() * pulled / damping.nu;
    system_.triangularView<Eigen::Lower>() -= pulled.transpose() * weighted_;
  }
  sum_terms(rows_of_terms(rows), rows.count(), system_, work_);
  system_.diagonal() += rows.weight().cwiseInverse();
  factor_lifted(system_, work_);
}

void MaterialSpace::divide_mixing(Eigen::MatrixXd& columns) const {
  const auto moved = columns.cols();
  const auto s = mixing_.bottomRightCorner(columns.rows(), moved);
  const Eigen::RowVectorXd along = s.cwiseProduct(columns).colwise().sum();
  columns = (columns - s * along.transpose().cwiseProduct(shrink_).asDiagonal()) / damping_.nu;
}

void MaterialSpace::back_substitute(const ModeSystems& systems, const ConstraintRows& rows,
                                    Lanes& force, const Eigen::MatrixXd& mixing_force,
                                    MaterialStep& step) {
  const Eigen::Index held = damping_.held;
  const bool with_mixing = std::isfinite(damping_.nu);
  // step.m holds the residuals; force and mixing_force are minus the gradients.
  lanes_work_ = force;
  systems.solve(lanes_work_);
  const RowProducts j{systems, rows, jacobian_};
  j.multiply(lanes_work_, along_);
  step.m -= along_;
  if (with_mixing) {
    Eigen::MatrixXd pulled = mixing_force;
    divide_mixing(pulled);
    const Eigen::VectorXd by_mixing =
        (pulled.transpose() * free_hat_).cwiseProduct(at_terms_).colwise().sum().transpose();
    for (int term = 0; term < rows.term_count(); ++term)
      step.m[rows.row_of(term)] -= by_mixing[term];
  }
  system_.triangularView<Eigen::Lower>().solveInPlace(step.m);
  system_.transpose().triangularView<Eigen::Upper>().solveInPlace(step.m);
  j.add_transposed(step.m, force);
  systems.solve(force);
  step.z = force;
  step.mixing.setZero(mixing_.rows(), mixing_.cols());
  if (!with_mixing) return;
  Eigen::MatrixXd columns = mixing_force;
  Eigen::VectorXd of_terms(rows.term_count());
  for (int term = 0; term < rows.term_count(); ++term) of_terms[term] = step.m[rows.row_of(term)];
  columns.noalias() += free_hat_ * of_terms.asDiagonal() * at_terms_.transpose();
  divide_mixing(columns);
  step.mixing.bottomRightCorner(columns.rows(), mixing_.cols() - held) = columns;
}

void MaterialSpace::step(const ModeSystems& systems, const ConstraintRows& rows,
                         const MaterialPoint& point, const Damping& damping, MaterialStep& step) {
  factor(systems, rows, point, damping);
  const Eigen::Index held = damping.held;
  Lanes force;
  systems.apply(point.z, force);
  force = -force;
  const Eigen::MatrixXd mixing_force =
      -damping.mu *
      column_gradient(mixing_).bottomRightCorner(mixing_.rows() - held, mixing_.cols() - held);
  rows.shifted(point.rows.residual, step.m);
  back_substitute(systems, rows, force, mixing_force, step);
  step.promise = model_decrease(systems, rows, point, step);
}

void MaterialSpace::correct(const ModeSystems& systems, const ConstraintRows& rows,
                            const Eigen::VectorXd& residual, MaterialStep& step) {
  Lanes force = Lanes::Zero(systems.lanes(), systems.kept_count());
  const Eigen::MatrixXd mixing_force =
      Eigen::MatrixXd::Zero(mixing_.rows() - damping_.held, mixing_.cols() - damping_.held);
  step.m = residual;
  back_substitute(systems, rows, force, mixing_force, step);
}

double MaterialSpace::model_decrease(const ModeSystems& systems, const ConstraintRows& rows,
                                     const MaterialPoint& point, const MaterialStep& step) {
  Lanes product;
  systems.apply(point.z + 0.5 * step.z, product);
  double decrease = -lane_dot(product, step.z);
  Eigen::VectorXd shifted;
  rows.shifted(point.rows.residual, shifted);
  const Eigen::MatrixXd turned = step.mixing.transpose() * hat_;  // r x terms
  Eigen::VectorXd of_rows = Eigen::VectorXd::Zero(rows.count());
  for (int term = 0; term < rows.term_count(); ++term) {
    const auto kept = systems.kept_of_knot(rows.knot_of(term));
    of_rows[rows.row_of(term)] +=
        lane_dot(jacobian_.col(term).data(), step.z.col(kept).data(), systems.lanes()) +
        turned.col(term).dot(point.z.col(kept).head(systems.modes()));
  }
  for (int row = 0; row < rows.count(); ++row)
    decrease += rows.weight()[row] * of_rows[row] * (shifted[row] - 0.5 * of_rows[row]);
  const Eigen::ArrayXd along = mixing_.cwiseProduct(step.mixing).colwise().sum().transpose();
  const Eigen::ArrayXd excess = mixing_.colwise().squaredNorm().transpose().array() - 1;
  return decrease - 4 * damping_.mu * (along * (excess + along)).sum();
}

}  // namespace limber::spacetime
