#pragma once

#include <Eigen/Core>

#include "engine/rods/solver/condensed_solver.h"

namespace limber::rods {

/// A factored Hessian with a few rows more:
///
///   [ H   A^T ] [ x ]   [ b ]
///   [ A   -C  ] [ y ] = [ c ]
///
/// With C = 0 the rows are linear constraints A x = c (a mean opening angle, single angles) and y
/// their forces with opposite sign. With C > 0 they are springs of compliance C between H's
/// unknowns, x = (H + A^T C^-1 A)^-1 (b + A^T C^-1 c). This is Woodbury's formula, and C may tend
/// to zero.
class BorderedSolver {
 public:
  /// @param rows        k x size(), A
  /// @param compliance  k numbers >= 0, the diagonal of C
  /// @pre the solver is factored, and stays alive and as it is while this is used. Columns of
  /// pinned unknowns must be zero in A.
  /// @throws Error{kNumerical} where rows depend on each other (or vanish) so that nothing
  /// determines their forces; names the field rows
  BorderedSolver(CondensedSolver& solver, const Eigen::Ref<const Eigen::MatrixXd>& rows,
                 const Eigen::Ref<const Eigen::VectorXd>& compliance);

  /// Number of negative eigenvalues of H over the x with A x = 0 (with springs: of H + A^T C^-1 A).
  /// A constraint can hold a direction in which H alone is unstable.
  [[nodiscard]] int negative() const { return negative_; }
  /// No negative and no vanishing ones.
  [[nodiscard]] bool positive_definite() const;

  /// b <- x, c <- y.
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> b, Eigen::Ref<Eigen::VectorXd> c) const;

 private:
  CondensedSolver& solver_;
  Eigen::MatrixXd columns_;  // A^T
  Eigen::MatrixXd answers_;  // H^-1 A^T
  Eigen::MatrixXd vectors_;  // of C + A H^-1 A^T
  Eigen::VectorXd values_;
  int negative_ = 0;
};

}  // namespace limber::rods
