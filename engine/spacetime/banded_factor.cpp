#include "engine/spacetime/banded_factor.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/lane_turn.h"

namespace limber::spacetime {

namespace {

/// Row times z, of rows whose width lies in z, kLaneWidth lanes.
template <int kWidth>
LanePacket row_product(const double* v, const double* zs, Eigen::Index lanes) {
  LanePacket value = load_lanes(v) * load_lanes(zs);
  unrolled<kWidth - 1>([&](auto before) {
    const Eigen::Index at = (before + 1) * lanes;
    value += load_lanes(v + at) * load_lanes(zs + at);
  });
  return value;
}

template <int kWidth>
void add_normal(const double* v, const double* zs, double* out, Eigen::Index lanes) {
  for (Eigen::Index k = 0; k < lanes; k += kLaneWidth) {
    const LanePacket value = row_product<kWidth>(v + k, zs + k, lanes);
    unrolled<kWidth>([&](auto c) {
      const Eigen::Index at = c * lanes + k;
      store_lanes(load_lanes(out + at) + load_lanes(v + at) * value, out + at);
    });
  }
}

template <int kWidth>
void add_squares(const double* v, const double* zs, double* sums, Eigen::Index lanes) {
  for (Eigen::Index k = 0; k < lanes; k += kLaneWidth) {
    const LanePacket value = row_product<kWidth>(v + k, zs + k, lanes);
    store_lanes(load_lanes(sums + k) + value * value, sums + k);
  }
}

Eigen::ArrayXd product_over_seam(const BandedRow& row, Eigen::Index width, const Lanes& z) {
  return row.values.leftCols(width).cwiseProduct(z.middleCols(row.start, width)).rowwise().sum() +
         row.behind.cwiseProduct(z.rightCols(row.behind.cols())).rowwise().sum();
}

}  // namespace

void apply_normal(const std::vector<BandedRow>& rows, const Lanes& z, Lanes& product) {
  const auto lanes = z.rows();
  product.setZero(lanes, z.cols());
  for (const BandedRow& row : rows) {
    const auto width = std::min(row.values.cols(), z.cols() - row.start);
    if (row.behind.size() > 0) {
      const Eigen::ArrayXd value = product_over_seam(row, width, z);
      product.middleCols(row.start, width) +=
          (row.values.leftCols(width).array().colwise() * value).matrix();
      product.rightCols(row.behind.cols()) += (row.behind.array().colwise() * value).matrix();
      continue;
    }
    const double* zs = z.col(row.start).data();
    const double* v = row.values.data();
    double* __restrict out = product.col(row.start).data();
    if (width == 4) {
      add_normal<4>(v, zs, out, lanes);
    } else if (width == 6) {
      add_normal<6>(v, zs, out, lanes);
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
    const auto width = std::min(row.values.cols(), z.cols() - row.start);
    if (row.behind.size() > 0) {
      sums.array() += product_over_seam(row, width, z).square();
      continue;
    }
    const double* zs = z.col(row.start).data();
    const double* v = row.values.data();
    if (width == 4) {
      add_squares<4>(v, zs, sums.data(), lanes);
    } else if (width == 6) {
      add_squares<6>(v, zs, sums.data(), lanes);
    } else {
      for (Eigen::Index k = 0; k < lanes; ++k) {
        double value = 0;
        for (Eigen::Index c = 0; c < width; ++c) value += v[c * lanes + k] * zs[c * lanes + k];
        sums[k] += value * value;
      }
    }
  }
  return 0.5 * sums.sum();
}

void BandedFactor::spread(const BandedRow& row, Lanes& numbers) const {
  numbers.setZero();
  numbers.leftCols(width_) = row.values;
  if (border_ == 0) return;
  const int inner = columns_ - border_;
  if (row.start < inner) {
    for (int c = inner - row.start; c < std::min(width_, columns_ - row.start); ++c) {
      numbers.col(width_ + row.start + c - inner) = row.values.col(c);
      numbers.col(c).setZero();
    }
    if (row.behind.size() > 0) numbers.rightCols(border_) += row.behind;
  } else if (row.behind.size() > 0) {
    numbers.leftCols(border_) += row.behind;  // there are no other columns
  }
}

void BandedFactor::factor(const std::vector<BandedRow>& rows, int width, int columns, int lanes,
                          double shift, Shape shape) {
  LIMBER_DEMAND(width == 4 || width == 6);
  width_ = width;
  border_ = shape == Shape::kCycle ? std::min(width / 2, columns) : 0;
  LIMBER_DEMAND(border_ == 0 || border_ == width / 2);
  columns_ = columns;
  lanes_ = lanes;
  r_.assign(place(columns), 0.0);
  occupied_.assign(static_cast<std::size_t>(columns), 0);
  Lanes scratch(lanes, width_ + border_);
  const double root = std::sqrt(shift);
  std::size_t next = 0;
  for (int column = 0; column < columns; ++column) {
    for (; next < rows.size() && rows[next].start <= column; ++next) {
      spread(rows[next], scratch);
      insert(rows[next].start, scratch.data());
    }
    scratch.setZero();
    scratch.col(0).setConstant(root);
    insert(column, scratch.data());
  }
  for (int column = 0; column < columns; ++column) {
    double* diagonal = r_.data() + place(column);
    for (int k = 0; k < lanes; ++k) diagonal[k] = 1 / diagonal[k];
  }
}

void BandedFactor::insert(int start, double* row) {
  if (border_ == 0)
    return width_ == 4 ? insert_row<4, 0>(start, row) : insert_row<6, 0>(start, row);
  return width_ == 4 ? insert_row<4, 2>(start, row) : insert_row<6, 3>(start, row);
}

template <int kWidth, int kBorder>
void BandedFactor::insert_row(int start, double* row) {
  const auto lanes = static_cast<std::size_t>(lanes_);
  for (int column = start; column < columns_; ++column) {
    double* r = r_.data() + place(column);
    if (kBorder > 0 && column == columns_ - kBorder && column > start) {
      // The band has ended: the rest of the row begins here.
      std::copy_n(row + kWidth * lanes, kBorder * lanes, row);
      std::fill_n(row + kBorder * lanes, kWidth * lanes, 0.0);
    }
    if (!occupied_[static_cast<std::size_t>(column)]) {
      std::copy(row, row + (kWidth + kBorder) * lanes, r);
      occupied_[static_cast<std::size_t>(column)] = 1;
      return;
    }
    for (std::size_t k = 0; k < lanes; k += kLaneWidth) {
      const LaneTurn turn(load_lanes(r + k), load_lanes(row + k));
      store_lanes(turn.length, r + k);
      unrolled<kWidth - 1>([&](auto before) {
        double *of_r = r + (before + 1) * lanes + k, *of_row = row + (before + 1) * lanes + k;
        const LanePacket a = load_lanes(of_r), b = load_lanes(of_row);
        store_lanes(turn.cosine * a + turn.sine * b, of_r);
        // The rest of the row, one column to the right.
        store_lanes(turn.cosine * b - turn.sine * a, of_row - lanes);
      });
      store_lanes(LanePacket::Zero(), row + (kWidth - 1) * lanes + k);
      unrolled<kBorder>([&](auto c) {
        double *of_r = r + (kWidth + c) * lanes + k, *of_row = row + (kWidth + c) * lanes + k;
        const LanePacket a = load_lanes(of_r), b = load_lanes(of_row);
        store_lanes(turn.cosine * a + turn.sine * b, of_r);
        store_lanes(turn.cosine * b - turn.sine * a, of_row);
      });
    }
  }
}

template <int kWidth, int kBorder>
void BandedFactor::forward(Lanes& x, int from) const {
  const auto lanes = static_cast<std::size_t>(lanes_);
  for (int j = from; j < columns_; ++j) {
    const double* rj = r_.data() + place(j);
    double* xj = x.col(j).data();
    for (std::size_t k = 0; k < lanes; ++k) xj[k] *= rj[k];
    for (int i = 1; i < kWidth && j + i < columns_; ++i) {
      const double* ri = rj + static_cast<std::size_t>(i) * lanes;
      double* __restrict xi = x.col(j + i).data();
      for (std::size_t k = 0; k < lanes; ++k) xi[k] -= ri[k] * xj[k];
    }
    for (int b = 0; b < kBorder && j < columns_ - kBorder; ++b) {
      const double* rb = rj + static_cast<std::size_t>(kWidth + b) * lanes;
      double* __restrict xb = x.col(columns_ - kBorder + b).data();
      for (std::size_t k = 0; k < lanes; ++k) xb[k] -= rb[k] * xj[k];
    }
  }
}

template <int kWidth, int kBorder>
void BandedFactor::backward(Lanes& x) const {
  const auto lanes = static_cast<std::size_t>(lanes_);
  for (int j = columns_ - 1; j >= 0; --j) {
    const double* rj = r_.data() + place(j);
    double* __restrict xj = x.col(j).data();
    for (int i = 1; i < kWidth && j + i < columns_; ++i) {
      const double* ri = rj + static_cast<std::size_t>(i) * lanes;
      const double* xi = x.col(j + i).data();
      for (std::size_t k = 0; k < lanes; ++k) xj[k] -= ri[k] * xi[k];
    }
    for (int b = 0; b < kBorder && j < columns_ - kBorder; ++b) {
      const double* rb = rj + static_cast<std::size_t>(kWidth + b) * lanes;
      const double* xb = x.col(columns_ - kBorder + b).data();
      for (std::size_t k = 0; k < lanes; ++k) xj[k] -= rb[k] * xb[k];
    }
    for (std::size_t k = 0; k < lanes; ++k) xj[k] *= rj[k];
  }
}

void BandedFactor::forward_substitute(Lanes& x, int from) const {
  if (border_ == 0) return width_ == 4 ? forward<4, 0>(x, from) : forward<6, 0>(x, from);
  return width_ == 4 ? forward<4, 2>(x, from) : forward<6, 3>(x, from);
}

void BandedFactor::back_substitute(Lanes& x) const {
  if (border_ == 0) return width_ == 4 ? backward<4, 0>(x) : backward<6, 0>(x);
  return width_ == 4 ? backward<4, 2>(x) : backward<6, 3>(x);
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
