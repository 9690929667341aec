#include "engine/base/numerics/banded_cholesky.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"

namespace limber {

bool BandedCholesky::factor(Eigen::MatrixXd band) {
  factor_ = std::move(band);
  const Eigen::Index n = factor_.cols(), width = factor_.rows() - 1;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double pivot = factor_(0, j);
    if (!(pivot > 0) || !std::isfinite(pivot)) {
      factor_.resize(0, 0);
      return false;
    }
    const Eigen::Index below = std::min(width, n - 1 - j);
    auto column = factor_.col(j);
    column.head(below + 1) /= std::sqrt(pivot);
    for (Eigen::Index d = 1; d <= below; ++d) {
      factor_.col(j + d).head(below - d + 1) -= column[d] * column.segment(d, below - d + 1);
    }
  }
  return true;
}

void BandedCholesky::solve(Columns& x) const {
  // The rows of one band, of this many columns, stay in the nearest cache.
  constexpr Eigen::Index kTogether = 64;
  LIMBER_DEMAND(factor_.cols() == x.rows());
  for (Eigen::Index first = 0; first < x.cols(); first += kTogether)
    solve_columns(x.middleCols(first, std::min(kTogether, x.cols() - first)));
}

void BandedCholesky::solve_columns(Eigen::Ref<Columns> x) const {
  const Eigen::Index n = factor_.cols(), width = factor_.rows() - 1;
  for (Eigen::Index j = 0; j < n; ++j) {
    x.row(j) /= factor_(0, j);
    const Eigen::Index below = std::min(width, n - 1 - j);
    for (Eigen::Index d = 1; d <= below; ++d) x.row(j + d) -= factor_(d, j) * x.row(j);
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    const Eigen::Index below = std::min(width, n - 1 - j);
    for (Eigen::Index d = 1; d <= below; ++d) x.row(j) -= factor_(d, j) * x.row(j + d);
    x.row(j) /= factor_(0, j);
  }
}

}  // namespace limber
