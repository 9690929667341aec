#include "engine/spacetime/material_step.h"

#include <cmath>

#include "engine/spacetime/constraint_system.h"
#include "engine/spacetime/material.h"

namespace limber::spacetime {
namespace {

/// A step in S moves the rows of keyframes too: all rows stay in C.
std::vector<RowBlock> all_rows(const ConstraintRows& rows) {
  std::vector<RowBlock> blocks;
  for (int knot = 0; knot < static_cast<int>(rows.knots().size()); ++knot)
    blocks.push_back({knot, rows.first_row(knot), rows.first_row(knot + 1) - rows.first_row(knot)});
  return blocks;
}

}  // namespace

void MaterialSpace::factor(const ModeSystems& systems, const ConstraintRows& rows,
                           const MaterialPoint& point, const Damping& damping) {
  const Eigen::Index n = rows.count();
  const Eigen::Index modes = systems.modes(), coordinates = point.mixing.rows();
  const Eigen::Index held = damping.held;
  damping_ = damping;
  hat_ = point.rows.jacobian.topRows(coordinates);
  mixing_ = point.mixing;
  jacobian_.setZero(systems.lanes(), n);
  jacobian_.topRows(modes).noalias() = mixing_.transpose() * hat_;

  response_of_rows(systems.green(), all_rows(rows), jacobian_, scaled_, system_);
  if (std::isfinite(damping.nu)) {
    const Eigen::Index moved = modes - held;
    at_rows_.resize(moved, n);
    for (Eigen::Index row = 0; row < n; ++row) {
      at_rows_.col(row) = point.z.col(systems.kept_of_knot(rows.knot_of(static_cast<int>(row))))
                              .segment(held, moved);
    }
    shrink_ =
        (8 * damping.mu /
         (damping.nu + 8 * damping.mu * mixing_.rightCols(moved).colwise().squaredNorm().array()))
            .matrix();
    free_hat_ = hat_.bottomRows(coordinates - held);
    work_.noalias() = free_hat_.transpose() * free_hat_;
    weighted_.noalias() = at_rows_.transpose() * at_rows_;
    system_.triangularView<Eigen::Lower>() += work_.cwiseProduct(weighted_) / damping.nu;
    const Eigen::MatrixXd pulled = at_rows_.cwiseProduct(jacobian_.middleRows(held, moved));
    weighted_ = shrink_.asDiagonal() * pulled / damping.nu;
    system_.triangularView<Eigen::Lower>() -= pulled.transpose() * weighted_;
  }
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
  for (int row = 0; row < rows.count(); ++row) {
    step.m[row] -=
        lane_dot(jacobian_.col(row).data(),
                 lanes_work_.col(systems.kept_of_knot(rows.knot_of(row))).data(), systems.lanes());
  }
  if (with_mixing) {
    Eigen::MatrixXd pulled = mixing_force;
    divide_mixing(pulled);
    step.m -= (pulled.transpose() * free_hat_).cwiseProduct(at_rows_).colwise().sum().transpose();
  }
  system_.triangularView<Eigen::Lower>().solveInPlace(step.m);
  system_.transpose().triangularView<Eigen::Upper>().solveInPlace(step.m);
  for (int row = 0; row < rows.count(); ++row) {
    lane_axpy(step.m[row], jacobian_.col(row).data(),
              force.col(systems.kept_of_knot(rows.knot_of(row))).data(), systems.lanes());
  }
  systems.solve(force);
  step.z = force;
  step.mixing.setZero(mixing_.rows(), mixing_.cols());
  if (!with_mixing) return;
  Eigen::MatrixXd columns = mixing_force;
  columns.noalias() += free_hat_ * step.m.asDiagonal() * at_rows_.transpose();
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
  const Eigen::MatrixXd turned = step.mixing.transpose() * hat_;  // r x rows
  for (int row = 0; row < rows.count(); ++row) {
    const auto kept = systems.kept_of_knot(rows.knot_of(row));
    const double along =
        lane_dot(jacobian_.col(row).data(), step.z.col(kept).data(), systems.lanes()) +
        turned.col(row).dot(point.z.col(kept).head(systems.modes()));
    decrease += rows.weight()[row] * along * (shifted[row] - 0.5 * along);
  }
  const Eigen::ArrayXd along = mixing_.cwiseProduct(step.mixing).colwise().sum().transpose();
  const Eigen::ArrayXd excess = mixing_.colwise().squaredNorm().transpose().array() - 1;
  return decrease - 4 * damping_.mu * (along * (excess + along)).sum();
}

}  // namespace limber::spacetime
