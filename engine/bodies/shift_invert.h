#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "engine/base/job.h"
#include "engine/base/numerics/sparse_cholesky.h"

namespace limber::bodies {

/// Matrix times a block, columns in parallel.
[[nodiscard]] Eigen::MatrixXd multiply_columns(const Eigen::SparseMatrix<double>& matrix,
                                               const Eigen::MatrixXd& x);

/// The operator whose largest eigenvalues are the smallest of K phi = lambda M phi:
///   OP x = P (K + s M)^-1 M x,   eigenvalues 1 / (lambda + s).
/// The shift s > 0 is a small fraction of the first elastic eigenvalue, so that K + s M is positive
/// definite for free bodies and mechanisms too. P = I - R R^T M removes the rigid modes R (they are
/// eigenvectors, so P commutes).
///
/// M is divided by its mean diagonal entry, so that M-normalised vectors have entries of order 1 in
/// any unit of mass.
class ShiftInvert {
 public:
  /// @param stiffness  K over the free degrees of freedom (full, symmetric, positive semidefinite)
  /// @param mass       M over the same (full, symmetric, positive definite)
  /// @param rigid      R, orthonormal under `mass`; no columns for a held body
  /// @param job        reports stage "modes"
  /// @throws Error{kNumerical} if no shift makes the matrix numerically positive definite
  ShiftInvert(Eigen::SparseMatrix<double> stiffness, Eigen::SparseMatrix<double> mass,
              Eigen::MatrixXd rigid, const JobContext& job);

  [[nodiscard]] Eigen::Index size() const { return stiffness_.rows(); }
  [[nodiscard]] double shift() const { return shift_; }  // s [1/s^2]
  [[nodiscard]] double first_eigenvalue() const {
    return first_eigenvalue_;
  }  // estimate of lambda_1, >= 0
  [[nodiscard]] double mass_unit() const {
    return mass_unit_;
  }  // what K and M were divided by [kg]

  /// K and M divided by mass_unit(): same eigenvalues.
  [[nodiscard]] const Eigen::SparseMatrix<double>& stiffness() const { return stiffness_; }
  [[nodiscard]] const Eigen::SparseMatrix<double>& mass() const { return mass_; }

  /// M x for a block, columns in parallel.
  [[nodiscard]] Eigen::MatrixXd multiply_mass(const Eigen::MatrixXd& x) const;
  /// P (K + s M)^-1 b for a block b = M x.
  [[nodiscard]] Eigen::MatrixXd solve(Eigen::MatrixXd b) const;
  /// The same by blocks of eight columns, each on a thread of its own: for blocks of few columns.
  [[nodiscard]] Eigen::MatrixXd solve_in_pieces(Eigen::MatrixXd b) const;
  /// The same for one vector, in place, on the calling thread.
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> b, SparseCholesky::Workspace& workspace) const;
  /// x <- P x.
  void project(Eigen::Ref<Eigen::MatrixXd> x) const;

 private:
  void factor(double shift, const JobContext& job);
  [[nodiscard]] double estimate_first_eigenvalue(const JobContext& job) const;

  Eigen::SparseMatrix<double> stiffness_, mass_;
  Eigen::MatrixXd rigid_, mass_rigid_;
  double mass_unit_ = 1;
  double shift_ = 0;
  double first_eigenvalue_ = 0;
  SparseCholesky cholesky_;
};

/// Rayleigh-Ritz of OP on the columns of a block (Bathe's subspace iteration): K enters through the
/// factor only, so that small eigenvalues keep their digits next to stiff parts.
struct RitzBlock {
  Eigen::VectorXd eigenvalues;   // of K phi = lambda M phi, ascending
  Eigen::MatrixXd vectors;       // M-orthonormal
  Eigen::MatrixXd mass_vectors;  // M times vectors
};

/// One step: Y = OP X, then the Ritz pairs of the span of Y.
/// @param mass_x  M X, any block of full rank
[[nodiscard]] RitzBlock subspace_step(const ShiftInvert& op, const Eigen::MatrixXd& mass_x);

}  // namespace limber::bodies
