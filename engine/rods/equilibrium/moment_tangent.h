#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/rods/equilibrium/hessian_factor.h"
#include "engine/rods/solver/condensed_matrix.h"

namespace limber::rods::detail {

/// The full tangent of the imbalance under moments that keep their direction, which have no
/// potential. It is K = H + sum over joints of the skew blocks -[m]x / 2 on their rotations. Spins
/// do not commute: second derivatives along exp are the symmetric part of how elastic moments
/// change. Few joints have moments, so that K is solved by Woodbury's formula with the factor of H,
/// which may be indefinite.
class MomentTangent {
 public:
  /// Joints with moments at most: three dense columns of all unknowns belong to each.
  static constexpr int kMaxJoints = 32;

  /// @param factor     bordered, of H or of its rest after Metric::taken; stays unchanged while
  ///                   this is used
  /// @param rotations  first unknowns of the rotations that moments act on, kMaxJoints at most
  /// @param moments    by unknown
  MomentTangent(const HessianFactor& factor, const std::vector<int>& rotations,
                const Eigen::VectorXd& moments);

  /// b <- x of K x = b; rows: remaining distances of constraints.
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> b, Eigen::VectorXd rows) const;

  /// E = stiffness + diagonal, positive definite.
  struct Metric {
    const CondensedMatrix& stiffness;
    Eigen::VectorXd diagonal;
    /// The factor is that of H - taken stiffness, 0 <= taken << 1.
    double taken = 0;
  };
  /// Number of eigenvalues of K x = lambda E x with negative real parts: motions that grow under K
  /// x + E x' = 0. Rods move so if their material damps as it resists, slowly enough for masses not
  /// to matter. Without moments that is the inertia of H, whatever E is.
  ///
  /// Those that moments have no part in are negative pivots (that is below `taken`); the others are
  /// found in the Krylov space of H^-1 E and the moments. None where that is too large to tell.
  [[nodiscard]] std::optional<int> unstable(const Metric& metric) const;

 private:
  [[nodiscard]] Eigen::MatrixXd at_rotations(const Eigen::Ref<const Eigen::MatrixXd>& x) const;

  const HessianFactor& factor_;
  const std::vector<int>& rotations_;
  Eigen::MatrixXd skew_;     // B: 3 rows a joint, block diagonal
  Eigen::MatrixXd answers_;  // Z: H^-1 of unit moments, a column each
  Eigen::MatrixXd small_;    // (I + B Z at rotations)^-1 B
  double ratio_ = 1;         // det K / det H
};

}  // namespace limber::rods::detail
