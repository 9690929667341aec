#pragma once

#include <Eigen/Core>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"

namespace limber::spacetime {

/// The lower triangle of J P^-1 J^T over all rows (P^-1 is diagonal in the modes, see NOTATION.md).
/// @param jacobian  lanes x rows
/// @param scaled    work, becomes lanes x rows
void response_of_rows(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian,
                      Lanes& scaled, Eigen::MatrixXd& system);

/// system <- its Cholesky factor (lower). Exact rows that depend on each other leave it singular to
/// rounding: it is lifted by as little as makes it factor. The error is one of the step only, and
/// gone with the next.
/// @throws Error{kNumerical} for numbers that are not finite
void factor_lifted(Eigen::MatrixXd& system, Eigen::MatrixXd& work);

}  // namespace limber::spacetime
