#pragma once

#include <Eigen/Core>

namespace limber {

/// Cholesky factor of a symmetric positive definite band matrix, for the many systems of a time
/// line. There is no fill outside the band, so n rows of half-bandwidth b cost n b^2, a solve n b
/// for each right-hand side.
class BandedCholesky {
 public:
  /// Right-hand sides and solutions: a row per unknown, so that a solve runs along rows.
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// @param band  (b + 1) x n: entry (d, j) is A(j + d, j); entries past the last row are not read
  /// @returns false if a pivot is not positive: no solve is possible then
  [[nodiscard]] bool factor(Eigen::MatrixXd band);

  /// x <- A^-1 x, n x columns.
  void solve(Columns& x) const;

 private:
  void solve_columns(Eigen::Ref<Columns> x) const;

  Eigen::MatrixXd factor_;  // L in the same storage
};

}  // namespace limber
