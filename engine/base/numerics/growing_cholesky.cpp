#include "engine/base/numerics/growing_cholesky.h"

#include <Eigen/Jacobi>
#include <cmath>

#include "engine/base/error.h"

namespace limber {

bool GrowingCholesky::append(const Eigen::Ref<const Eigen::VectorXd>& cross, double diagonal,
                             double least_pivot) {
  LIMBER_DEMAND(cross.size() == size_ && size_ < lower_.rows());
  Eigen::VectorXd row = cross;
  lower_.topLeftCorner(size_, size_).triangularView<Eigen::Lower>().solveInPlace(row);
  const double pivot = diagonal - row.squaredNorm();
  if (!(pivot > least_pivot)) return false;
  lower_.row(size_).head(size_) = row.transpose();
  lower_(size_, size_) = std::sqrt(pivot);
  ++size_;
  return true;
}

void GrowingCholesky::remove(Eigen::Index index) {
  LIMBER_DEMAND(index >= 0 && index < size_);
  for (Eigen::Index row = index; row + 1 < size_; ++row) {
    lower_.row(row).head(row + 2) = lower_.row(row + 1).head(row + 2);
  }
  --size_;
  // One entry above the diagonal is left in each moved row; rotations of neighbouring columns take
  // it away.
  for (Eigen::Index k = index; k < size_; ++k) {
    Eigen::JacobiRotation<double> rotation;
    double pivot = 0;
    rotation.makeGivens(lower_(k, k), lower_(k, k + 1), &pivot);
    for (Eigen::Index row = k; row < size_; ++row) {
      const double a = lower_(row, k);
      const double b = lower_(row, k + 1);
      lower_(row, k) = rotation.c() * a - rotation.s() * b;
      lower_(row, k + 1) = rotation.s() * a + rotation.c() * b;
    }
    if (lower_(k, k) < 0) lower_.col(k).segment(k, size_ - k) *= -1;
  }
}

Eigen::VectorXd GrowingCholesky::solve(const Eigen::Ref<const Eigen::VectorXd>& b) const {
  LIMBER_DEMAND(b.size() == size_);
  const auto lower = lower_.topLeftCorner(size_, size_).triangularView<Eigen::Lower>();
  Eigen::VectorXd x = b;
  lower.solveInPlace(x);
  lower.transpose().solveInPlace(x);
  return x;
}

}  // namespace limber
