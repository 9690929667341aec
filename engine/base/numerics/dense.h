#pragma once

#include <Eigen/Core>

namespace limber {

// Decompositions of dense matrices of any size, by Eigen. They are instantiated once, in dense.cpp:
// each takes seconds to compile, and was compiled in every file that used it.

/// Eigenvalues, ascending, and orthonormal eigenvectors of a symmetric matrix.
class SymmetricEigen {
 public:
  /// @param matrix  n x n, its lower triangle is read
  explicit SymmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
  /// Decomposes a tridiagonal matrix. @param beside  n - 1 entries next to the diagonal
  SymmetricEigen(const Eigen::Ref<const Eigen::VectorXd>& diagonal,
                 const Eigen::Ref<const Eigen::VectorXd>& beside);

  [[nodiscard]] const Eigen::VectorXd& eigenvalues() const { return values_; }
  [[nodiscard]] const Eigen::MatrixXd& eigenvectors() const { return vectors_; }

 private:
  Eigen::VectorXd values_;
  Eigen::MatrixXd vectors_;
};

/// A v = lambda B v with A symmetric and B positive definite: lambda ascending, V^T B V = I.
class GeneralizedSymmetricEigen {
 public:
  GeneralizedSymmetricEigen(const Eigen::Ref<const Eigen::MatrixXd>& a,
                            const Eigen::Ref<const Eigen::MatrixXd>& b);

  [[nodiscard]] bool has_converged() const { return has_converged_; }
  [[nodiscard]] const Eigen::VectorXd& eigenvalues() const { return values_; }
  [[nodiscard]] const Eigen::MatrixXd& eigenvectors() const { return vectors_; }

 private:
  Eigen::VectorXd values_;
  Eigen::MatrixXd vectors_;
  bool has_converged_ = false;
};

/// A = U diag(values) V^T of an m x n matrix: U m x k, V n x k, k = min(m, n), values descending.
struct ThinSvd {
  Eigen::MatrixXd u;
  Eigen::VectorXd values;
  Eigen::MatrixXd v;
};
[[nodiscard]] ThinSvd thin_svd(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

/// Householder QR of an m x n matrix, m >= n: its first n columns of Q in place of it.
/// @returns the diagonal of R, n
Eigen::VectorXd orthonormalise_columns(Eigen::MatrixXd& matrix);

/// Q^T v with the whole Q of the Householder QR of a matrix.
[[nodiscard]] Eigen::VectorXd rotate_by_qr(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                           const Eigen::Ref<const Eigen::VectorXd>& v);

/// QR with column pivoting, A P = Q R.
struct PivotedQr {
  Eigen::MatrixXd r;        // min(m, n) x n, upper triangular
  Eigen::VectorXi columns;  // column i of A P is column columns[i] of A
  [[nodiscard]] Eigen::VectorXd permuted(const Eigen::Ref<const Eigen::VectorXd>& v) const;
};
[[nodiscard]] PivotedQr pivoted_qr(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

/// Orthonormal columns that span those of a matrix; pivots below `threshold` times the largest do
/// not count.
[[nodiscard]] Eigen::MatrixXd orthonormal_range(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                                double threshold);

}  // namespace limber
