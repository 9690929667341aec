#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"

namespace limber::bodies {

struct ModalOptions {
  int mode_count = 30;      // elastic modes wanted, > 0, at most the elastic degrees of freedom
  double tolerance = 1e-8;  // on ModalBasis::max_residual, in (0, 1e-2]; rounding may not allow it
  int max_restarts = 300;   // of Lanczos, > 0

  void validate() const;
};

/// Smallest eigenpairs of K phi = lambda M phi (paper: space-time editing, eq. 2), M the consistent
/// mass. Degrees of freedom are ordered 3 * node + axis; fixed nodes have zero rows.
struct ModalBasis {
  Eigen::VectorXd eigenvalues;  // [1/s^2], ascending; exactly 0 for the rigid modes, else > 0
  Eigen::MatrixXd modes;        // 3n x (rigid_count + mode_count), phi^T M phi = I [1/sqrt(kg)]
  /// 0, or 6 for a free body: three translations (x, y, z), three rotations (RigidModes), then
  /// elastic.
  int rigid_count = 0;
  /// Number of first elastic modes whose energy is rounding noise: parts that fold about an edge or
  /// node, or a body held along a line only. They have no stiffness. To keep ratios of eigenvalues
  /// finite, theirs is set to 1e-4 of the first other one.
  int mechanism_count = 0;
  /// Worst residual r = K phi - lambda M phi of the elastic pairs, relative, in the norm of energy:
  /// sqrt(sum_i r_i^2 / K_ii) / sqrt(lambda). Unlike |r| it does not drown in the rounding of parts
  /// much stiffer than the mode. K phi is summed tet by tet. With cells flat by a million or
  /// stiffnesses ten thousand millions apart, the rounding of K's entries exceeds the difference
  /// between its modes and those of the body.
  double max_residual = 0;
  /// Bound of the relative error of eigenvalues, over elastic modes that are not mechanisms. It is
  /// the largest |r| / sqrt(lambda) in the norm of K^-1 (Parlett 1998, sec. 15.9) and excludes the
  /// rounding of r itself. max_residual is no bound if K is ill-conditioned: in sheets flat by a
  /// million it is 6e-10, and the first eigenvalue has an error of 5e-4.
  double eigenvalue_error = 0;
};

/// Shift-invert Lanczos by blocks, where that does not converge by vectors (Spectra), on a CHOLMOD
/// factor. Signs are fixed (largest entry positive), so
/// reruns are equal.
/// @throws Error{kInvalidArgument} for more modes than degrees of freedom, Error{kNumerical} if
/// Lanczos fails.
[[nodiscard]] ModalBasis modal_analysis(const ElasticBody& body, const ModalOptions& options,
                                        const JobContext& job = {});

}  // namespace limber::bodies
