#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"

namespace limber::bodies {

struct ModalOptions {
  int mode_count = 30;      // elastic modes wanted, > 0 and below the free degrees of freedom
  double tolerance = 1e-8;  // relative residual |K phi - lambda M phi| / (lambda |M phi|) asked of
                            // Lanczos, in (0, 1e-2]
  int max_restarts = 300;   // > 0

  void validate() const;
};

/// Smallest eigenpairs of K phi = lambda M phi (paper: space-time editing, eq. 2).
/// Degrees of freedom are ordered 3 * node + axis; fixed nodes have zero rows.
struct ModalBasis {
  Eigen::VectorXd eigenvalues;  // [1/s^2], ascending; exactly 0 for the rigid modes
  Eigen::MatrixXd modes;        // 3n x (rigid_count + mode_count), phi^T M phi = I [1/sqrt(kg)]
  int rigid_count =
      0;  // 0, or 6 for a free body: three translations (x, y, z), three rotations, then elastic
  double max_residual = 0;  // worst relative residual of the elastic pairs
};

/// Shift-invert Lanczos (Spectra) on a CHOLMOD factor. Signs are fixed (largest entry positive), so
/// reruns are equal.
/// @throws Error{kInvalidArgument} for more modes than degrees of freedom, Error{kNumerical} if
/// Lanczos fails.
[[nodiscard]] ModalBasis modal_analysis(const ElasticBody& body, const ModalOptions& options,
                                        const JobContext& job = {});

}  // namespace limber::bodies
