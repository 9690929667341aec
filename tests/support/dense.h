#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SparseCore>
#include <memory>

// Decompositions that tests compare with: Eigen's, never the engine's. They are instantiated once,
// in dense.cpp: each takes seconds to compile in every file that writes it out.
namespace limber::reference {

/// Of a symmetric matrix, n x n, its lower triangle is read; ascending.
[[nodiscard]] Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& matrix);

/// How many eigenvalues of a symmetric matrix are below zero.
[[nodiscard]] int negative_eigenvalues(const Eigen::MatrixXd& matrix);

struct SymmetricEigen {
  Eigen::VectorXd values;   // n, ascending
  Eigen::MatrixXd vectors;  // n x n, orthonormal columns
};
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& matrix);

/// A v = lambda B v with A symmetric and B positive definite, n x n; lambda ascending.
[[nodiscard]] Eigen::VectorXd generalized_eigenvalues(const Eigen::MatrixXd& a,
                                                      const Eigen::MatrixXd& b);

/// Whether a symmetric matrix has a Cholesky factor.
[[nodiscard]] bool is_positive_definite(const Eigen::MatrixXd& matrix);

/// A x = b with A symmetric, n x n: by L D L^T. @param right  n x k
[[nodiscard]] Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& matrix,
                                              const Eigen::MatrixXd& right);

/// Of A, m x n with independent rows: orthonormal columns that span the x with A x = 0, n x (n -
/// m).
[[nodiscard]] Eigen::MatrixXd kernel(const Eigen::MatrixXd& matrix);

/// A = Q R by Householder reflections; A m x n, m >= n.
class ThinQr {
 public:
  explicit ThinQr(const Eigen::MatrixXd& matrix);

  /// m x n, orthonormal columns
  [[nodiscard]] const Eigen::MatrixXd& q() const { return q_; }
  /// n x n, upper triangular
  [[nodiscard]] const Eigen::MatrixXd& r() const { return r_; }
  /// The x with the least |A x - b|, the x with A x = b where m = n; columns of A must be
  /// independent. @param right  m
  [[nodiscard]] Eigen::VectorXd least_squares(const Eigen::VectorXd& right) const;

 private:
  Eigen::MatrixXd q_, r_;
};

/// A = U diag(values) V^T, 3 x 3; values descending.
struct Svd3 {
  Eigen::Matrix3d u;
  Eigen::Vector3d values;
  Eigen::Matrix3d v;
};
[[nodiscard]] Svd3 svd(const Eigen::Matrix3d& matrix);

/// Of points as columns, 3 x n with n >= 3; descending.
[[nodiscard]] Eigen::Vector3d singular_values(const Eigen::Matrix3Xd& points);

/// The smallest rotation that takes a direction to another, which is not its opposite. (Eigen's own
/// FromTwoVectors brings a singular value decomposition.)
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from,
                                                  const Eigen::Vector3d& to);

using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

/// A x = b, n x n: by LU with full pivoting.
[[nodiscard]] LongVector solve_in_long_double(const LongMatrix& matrix, const LongVector& right);

/// The x with the least |A x - b|, A m x n with independent columns: by Householder QR.
[[nodiscard]] LongVector least_squares_in_long_double(const LongMatrix& matrix,
                                                      const LongVector& right);

/// L D L^T of a sparse symmetric matrix, n x n, whose lower triangle is read.
class SparseLdlt {
 public:
  explicit SparseLdlt(const Eigen::SparseMatrix<double>& matrix);

  /// False where a pivot is zero: then there is no solution.
  [[nodiscard]] bool has_factor() const;
  /// D, n, in the order of elimination
  [[nodiscard]] Eigen::VectorXd pivots() const;
  /// @param right  n x k
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;

 private:
  struct Factor;
  std::shared_ptr<const Factor> factor_;
};

}  // namespace limber::reference
