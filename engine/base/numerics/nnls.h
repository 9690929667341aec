#pragma once

#include <Eigen/Core>
#include <vector>

namespace limber {

struct NnlsOptions {
  /// Stop when no inactive component of the scaled negative gradient exceeds this, in (0, 1).
  double tolerance = 1e-10;
  /// A column enters only if its part independent of the active ones is at least this share of its
  /// squared norm, in (0, 1); the others are copies of active columns.
  double rank_tolerance = 1e-12;
  /// Active sets visited; 0: 10 * columns + 100.
  int max_iterations = 0;

  void validate() const;
};

struct NnlsResult {
  Eigen::VectorXd x;         // >= 0; exactly 0 outside the support
  std::vector<int> support;  // ascending
  int iterations = 0;        // active sets solved
  bool converged = false;
  /// Largest violation of the optimality conditions: max over j of (rhs - gram x)_j, scaled by
  /// sqrt(gram_jj) and the largest |rhs_j| / sqrt(gram_jj).
  double optimality = 0;
};

/// Minimises |A x - b|^2 / 2 over x >= 0, given gram = A^T A and rhs = A^T b only. The number of
/// rows of A has no effect.
///
/// Lawson and Hanson's active set method (Solving Least Squares Problems, ch. 23) on the normal
/// equations. The Cholesky factor of the active block grows and shrinks by one column. Columns are
/// scaled to unit norm first; a zero column gets x = 0. Deterministic.
/// @param warm_support  columns to start from as active (from a neighbouring problem); may be empty
/// @throws Error{kInvalidArgument} for sizes that do not fit, values that are not finite, a
/// negative diagonal
[[nodiscard]] NnlsResult nnls(const Eigen::Ref<const Eigen::MatrixXd>& gram,
                              const Eigen::Ref<const Eigen::VectorXd>& rhs,
                              const NnlsOptions& options = {},
                              const std::vector<int>& warm_support = {});

}  // namespace limber
