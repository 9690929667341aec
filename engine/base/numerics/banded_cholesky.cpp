#include "engine/base/numerics/banded_cholesky.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/parallel.h"

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
  parallel_for(x.cols(), kTogether, [&](Eigen::Index begin, Eigen::Index end) {
    solve_columns(x.middleCols(begin, end - begin));
  });
}

void BandedCholesky::solve_columns(Eigen::Ref<Columns> x) const {
  // Each row is finished at once, as a product of a row of L or its transpose with the finished
  // rows. This needs a quarter of the memory traffic of one update per row.
  using Row = Eigen::Map<const Eigen::RowVectorXd, 0, Eigen::InnerStride<>>;
  const Eigen::Index n = factor_.cols(), width = factor_.rows() - 1;
  for (Eigen::Index j = 0; j < n; ++j) {
    const Eigen::Index done = std::min(width, j);
    // L(j, j - done ..): entries (d, j - d) of the storage, d downwards.
    const Row row(factor_.data() + j * (width + 1) - done * width, done,
                  Eigen::InnerStride<>(width));
    if (done > 0) x.row(j).noalias() -= row * x.middleRows(j - done, done);
    x.row(j) /= factor_(0, j);
  }
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    const Eigen::Index done = std::min(width, n - 1 - j);
    const auto column = factor_.col(j).segment(1, done);
    if (done > 0) x.row(j).noalias() -= column.transpose() * x.middleRows(j + 1, done);
    x.row(j) /= factor_(0, j);
  }
}

}  // namespace limber
