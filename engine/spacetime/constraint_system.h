#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/green_blocks.h"

namespace limber::spacetime {

/// The lower triangle of J P^-1 J^T over some rows, where P^-1 is diagonal in the modes (see
/// NOTATION.md).
/// @param green     P^-1 between the knots of these rows: block i of rows is at its place i
/// @param blocks    the rows, by knot; system counts them from 0 without gaps
/// @param jacobian  lanes x all rows
/// @param scaled    work, becomes lanes x these rows
void response_of_rows(const GreenBlocks& green, const std::vector<RowBlock>& blocks,
                      const Lanes& jacobian, Lanes& scaled, Eigen::MatrixXd& system);

/// system <- its Cholesky factor (lower). Exact rows that depend on each other leave it singular to
/// rounding: it is lifted by as little as makes it factor. The error is one of the step only, and
/// gone with the next.
/// @throws Error{kNumerical} for numbers that are not finite
void factor_lifted(Eigen::MatrixXd& system, Eigen::MatrixXd& work);

}  // namespace limber::spacetime
