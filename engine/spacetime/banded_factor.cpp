#include "engine/spacetime/banded_factor.h"

#include <algorithm>
#include <cmath>

namespace limber::spacetime {

void apply_normal(const std::vector<BandedRow>& rows, const Lanes& z, Lanes& product) {
  const auto lanes = z.rows();
  product.setZero(lanes, z.cols());
  for (const BandedRow& row : rows) {
    const auto width = std::min<Eigen::Index>(4, z.cols() - row.start);
    const double* zs = z.col(row.start).data();
    const double* v = row.values.data();
    double* __restrict out = product.col(row.start).data();
    if (width == 4) {
      for (Eigen::Index k = 0; k < lanes; ++k) {
        const double *vk = v + k, *zk = zs + k;
        const double value = vk[0] * zk[0] + vk[lanes] * zk[lanes] + vk[2 * lanes] * zk[2 * lanes] +
                             vk[3 * lanes] * zk[3 * lanes];
        out[k] += vk[0] * value;
        out[lanes + k] += vk[lanes] * value;
        out[2 * lanes + k] += vk[2 * lanes] * value;
        out[3 * lanes + k] += vk[3 * lanes] * value;
      }
    } else {
      for (Eigen::Index k = 0; k < lanes; ++k) {
        double value = 0;
        for (Eigen::Index c = 0; c < width; ++c) value += v[c * lanes + k] * zs[c * lanes + k];
        for (Eigen::Index c = 0; c < width; ++c) out[c * lanes + k] += v[c * lanes + k] * value;
      }
    }
  }
}

double half_square(const std::vector<BandedRow>& rows, const Lanes& z) {
  const auto lanes = z.rows();
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(lanes);
  for (const BandedRow& row : rows) {
    const auto width = std::min<Eigen::Index>(4, z.cols() - row.start);
    const double* zs = z.col(row.start).data();
    const double* v = row.values.data();
    for (Eigen::Index k = 0; k < lanes; ++k) {
      double value = 0;
      for (Eigen::Index c = 0; c < width; ++c) value += v[c * lanes + k] * zs[c * lanes + k];
      sums[k] += value * value;
    }
  }
  return 0.5 * sums.sum();
}

void BandedFactor::factor(const std::vector<BandedRow>& rows, int columns, int lanes,
                          double shift) {
  columns_ = columns;
  lanes_ = lanes;
  r_.assign(static_cast<std::size_t>(columns) * 4 * static_cast<std::size_t>(lanes), 0.0);
  occupied_.assign(static_cast<std::size_t>(columns), 0);
  Lanes scratch(lanes, 4);
  const double root = std::sqrt(shift);
  std::size_t next = 0;
  for (int column = 0; column < columns; ++column) {
    for (; next < rows.size() && rows[next].start <= column; ++next) {
      scratch = rows[next].values;
      insert(rows[next].start, scratch.data());
    }
    scratch.setZero();
    scratch.col(0).setConstant(root);
    insert(column, scratch.data());
  }
  for (int column = 0; column < columns; ++column) {
    double* diagonal =
        r_.data() + static_cast<std::size_t>(column) * 4 * static_cast<std::size_t>(lanes);
    for (int k = 0; k < lanes; ++k) diagonal[k] = 1 / diagonal[k];
  }
}

void BandedFactor::insert(int start, double* row) {
  const auto lanes = static_cast<std::size_t>(lanes_);
  double *v0 = row, *v1 = row + lanes, *v2 = row + 2 * lanes, *v3 = row + 3 * lanes;
  for (int column = start; column < columns_; ++column) {
    double* r0 = r_.data() + static_cast<std::size_t>(column) * 4 * lanes;
    if (!occupied_[static_cast<std::size_t>(column)]) {
      std::copy(row, row + 4 * lanes, r0);
      occupied_[static_cast<std::size_t>(column)] = 1;
      return;
    }
    double *r1 = r0 + lanes, *r2 = r0 + 2 * lanes, *r3 = r0 + 3 * lanes;
#pragma GCC ivdep
    for (std::size_t k = 0; k < lanes; ++k) {
      const double h = std::sqrt(r0[k] * r0[k] + v0[k] * v0[k]);
      const double ih = h > 0 ? 1 / h : 0.0;
      const double c = h > 0 ? r0[k] * ih : 1.0, s = v0[k] * ih;
      const double a1 = r1[k], a2 = r2[k], a3 = r3[k];
      r0[k] = h;
      r1[k] = c * a1 + s * v1[k];
      r2[k] = c * a2 + s * v2[k];
      r3[k] = c * a3 + s * v3[k];
      v0[k] = c * v1[k] - s * a1;  // the rest of the row, one column to the right
      v1[k] = c * v2[k] - s * a2;
      v2[k] = c * v3[k] - s * a3;
      v3[k] = 0;
    }
  }
}

void BandedFactor::forward_substitute(Lanes& x, int from) const {
  const auto lanes = static_cast<std::size_t>(lanes_);
  for (int j = from; j < columns_; ++j) {
    const double* rj = r_.data() + static_cast<std::size_t>(j) * 4 * lanes;
    double* xj = x.col(j).data();
    for (std::size_t k = 0; k < lanes; ++k) xj[k] *= rj[k];
    for (int i = 1; i <= 3 && j + i < columns_; ++i) {
      const double* ri = rj + static_cast<std::size_t>(i) * lanes;
      double* __restrict xi = x.col(j + i).data();
      for (std::size_t k = 0; k < lanes; ++k) xi[k] -= ri[k] * xj[k];
    }
  }
}

void BandedFactor::back_substitute(Lanes& x) const {
  const auto lanes = static_cast<std::size_t>(lanes_);
  for (int j = columns_ - 1; j >= 0; --j) {
    const double* rj = r_.data() + static_cast<std::size_t>(j) * 4 * lanes;
    double* __restrict xj = x.col(j).data();
    for (int i = 1; i <= 3 && j + i < columns_; ++i) {
      const double* ri = rj + static_cast<std::size_t>(i) * lanes;
      const double* xi = x.col(j + i).data();
      for (std::size_t k = 0; k < lanes; ++k) xj[k] -= ri[k] * xi[k];
    }
    for (std::size_t k = 0; k < lanes; ++k) xj[k] *= rj[k];
  }
}

void BandedFactor::solve(Lanes& x) const {
  forward_substitute(x, 0);
  back_substitute(x);
}

void BandedFactor::inverse_column(int column, Lanes& x) const {
  x.setZero(lanes_, columns_);
  x.col(column).setOnes();
  forward_substitute(x, column);
  back_substitute(x);
}

void BandedFactor::inverse_diagonal(int column, Eigen::VectorXd& own) const {
  // (R^T R)^-1 on the diagonal is the square of R^-T e.
  Lanes x = Lanes::Zero(lanes_, columns_);
  x.col(column).setOnes();
  forward_substitute(x, column);
  own = x.rightCols(columns_ - column).rowwise().squaredNorm();
}

}  // namespace limber::spacetime
