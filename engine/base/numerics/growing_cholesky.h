#pragma once

#include <Eigen/Core>

namespace limber {

/// Lower Cholesky factor of a symmetric positive definite matrix that gains a last row or loses any
/// row, each in O(k^2).
class GrowingCholesky {
 public:
  explicit GrowingCholesky(Eigen::Index capacity) : lower_(capacity, capacity) {}

  [[nodiscard]] Eigen::Index size() const { return size_; }

  /// Appends a row and column.
  /// @param cross        size() entries: the new row left of its diagonal
  /// @param diagonal     its diagonal entry
  /// @param least_pivot  the squared new pivot must exceed this; else the factor is unchanged and
  /// false is returned
  bool append(const Eigen::Ref<const Eigen::VectorXd>& cross, double diagonal, double least_pivot);

  /// Removes row and column `index`; later ones move up.
  void remove(Eigen::Index index);

  /// x with (L L^T) x = b.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::Ref<const Eigen::VectorXd>& b) const;

 private:
  Eigen::MatrixXd lower_;
  Eigen::Index size_ = 0;
};

}  // namespace limber
