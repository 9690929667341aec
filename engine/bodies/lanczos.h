#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"
#include "engine/bodies/shift_invert.h"

namespace limber::bodies {

/// Lanczos vectors (Spectra) for the `count` largest eigenvalues of OP, M-orthonormal, ascending in
/// lambda.
/// @param count      in [1, op.size() - rigid modes)
/// @param tolerance  relative residual of OP in the M-norm
/// @throws Error{kNumerical} if fewer converge within max_restarts
[[nodiscard]] Eigen::MatrixXd lanczos_modes(const ShiftInvert& op, int count, int largest_subspace,
                                            double tolerance, int max_restarts,
                                            const JobContext& job);

}  // namespace limber::bodies
