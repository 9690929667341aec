#pragma once

#include <Eigen/Core>

#include "engine/bodies/modal_analysis.h"

namespace limber::bench::stability {

/// How far eigenpairs are from the truth, by K and M that are written down tet by tet and kept in
/// long double: nothing of the engine but the mesh.
struct ModalCheck {
  /// The largest of: eigenvalues against energies of their modes (relative), deviations from
  /// orthonormality, and residuals in the norm of energy over sqrt(lambda).
  double error = 0;
  /// Its parts: eigenvalues, and residuals.
  double eigenvalue_error = 0, residual = 0;
  /// Eigenvalues that the basis has below its widest gap, and those there are by the inertia of
  /// K - sigma M.
  int listed = 0, counted = 0;
};
[[nodiscard]] ModalCheck check_modes(const bodies::ElasticBody& body,
                                     const bodies::ModalBasis& basis);

}  // namespace limber::bench::stability
