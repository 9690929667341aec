#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/numerics/raise_shift.h"
#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/green_blocks.h"

namespace limber::spacetime {

/// The lower triangle of J P^-1 J^T over some terms, where P^-1 is diagonal in the modes (see
/// NOTATION.md).
/// @param green     P^-1 between the knots of these terms: block i of terms is at its place i
/// @param blocks    the terms, by knot; system counts them from 0 without gaps
/// @param jacobian  lanes x all terms
/// @param scaled    work, becomes lanes x these terms
void response_of_terms(const GreenBlocks& green, const std::vector<TermBlock>& blocks,
                       const Lanes& jacobian, Lanes& scaled, Eigen::MatrixXd& system);

/// From a matrix over terms that of their rows, in place, lower triangles: each row is the sum of
/// its terms.
/// @param places  per term the place of its row; each of 0 .. count - 1 has one term or more
/// @param work    becomes the matrix over terms, where rows and terms are not the same
void sum_terms(const std::vector<int>& places, Eigen::Index count, Eigen::MatrixXd& system,
               Eigen::MatrixXd& work);

/// Relative lifts of a diagonal that rounding has left indefinite, after none at all.
inline constexpr ShiftSeries kLifts{1e-15, 10, 11};

/// system <- its Cholesky factor (lower). Exact rows that depend on each other leave it singular to
/// rounding: it is lifted by as little as makes it factor. The error affects only this step, not
/// the next.
/// @throws Error{kNumerical} for numbers that are not finite
void factor_lifted(Eigen::MatrixXd& system, Eigen::MatrixXd& work);

}  // namespace limber::spacetime
