#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/base/job.h"
#include "engine/bodies/shift_invert.h"

namespace limber::bodies {

/// Vectors for the `count` largest eigenvalues of OP, M-orthonormal, ascending in lambda, by block
/// Lanczos with full reorthogonalisation and without restarts (Golub and Underwood 1977). Blocks
/// read the factor once for many columns: on bodies of 90,000 tets a solve of one of them costs a
/// fifth of that of a single vector.
/// @param count      in [1, op.size() - rigid modes)
/// @param tolerance  relative residual of OP in the M-norm
/// @returns nothing where the space is exhausted or grows beyond its bound before they converge:
/// then lanczos_modes() is to be tried
[[nodiscard]] std::optional<Eigen::MatrixXd> block_krylov_modes(const ShiftInvert& op, int count,
                                                                double tolerance,
                                                                const JobContext& job);

}  // namespace limber::bodies
