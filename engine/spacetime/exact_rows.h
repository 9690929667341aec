#pragma once

#include <Eigen/Core>
#include <functional>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/newton_step.h"
#include "engine/spacetime/row_products.h"

namespace limber::spacetime {

/// The step d and the multipliers m that are due to c alone: H d = J^T m, m = W (c - J d).
using RowStep = std::function<void(const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m)>;

/// Corrects a step so that exact rows are met to first order: J d = residual there. A penalty W
/// takes off s / (s + 1 / W) of a row, s an eigenvalue of J H^-1 J^T. That is little where rows are
/// stiff. Conjugate gradients on just that map take off the rest.
/// @param residual   of all rows, not shifted
/// @param tolerance  of any exact row
/// @returns false where rows depend on or contradict each other: the step is of no use then
[[nodiscard]] bool meet_exact_rows(const ConstraintRows& rows, const RowProducts& products,
                                   const Eigen::VectorXd& residual, double tolerance,
                                   const RowStep& solve, Step& step);

}  // namespace limber::spacetime
