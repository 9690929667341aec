#include "engine/base/numerics/dense_front.h"

#include <cmath>

namespace limber::detail {
namespace {

constexpr std::ptrdiff_t kLanes = 4;
using Lanes [[gnu::vector_size(8 * kLanes), gnu::aligned(8), gnu::may_alias]] = double;

/// c -= a s^T for a tile of kLanes kRows rows and kColumns columns: a by columns, s by columns of
/// its rows.
template <int kRows, int kColumns>
[[gnu::always_inline]] inline void subtract_tile(int depth, const double* a, const double* s,
                                                 std::ptrdiff_t stride, double* c,
                                                 std::ptrdiff_t c_stride) {
  Lanes sum[kColumns][kRows];
  for (int n = 0; n < kColumns; ++n) {
    for (int r = 0; r < kRows; ++r)
      sum[n][r] = *reinterpret_cast<const Lanes*>(c + n * c_stride + kLanes * r);
  }
  for (int p = 0; p < depth; ++p) {
    Lanes column[kRows];
    for (int r = 0; r < kRows; ++r) column[r] = *reinterpret_cast<const Lanes*>(a + kLanes * r);
    for (int n = 0; n < kColumns; ++n) {
      for (int r = 0; r < kRows; ++r) sum[n][r] -= column[r] * s[n];
    }
    a += stride;
    s += stride;
  }
  for (int n = 0; n < kColumns; ++n) {
    for (int r = 0; r < kRows; ++r)
      *reinterpret_cast<Lanes*>(c + n * c_stride + kLanes * r) = sum[n][r];
  }
}

/// The same for a strip of any number of rows (up to three beyond are touched).
template <int kRows, int kColumns>
void subtract_strip(int rows, int depth, const double* a, const double* s, std::ptrdiff_t stride,
                    double* c, std::ptrdiff_t c_stride) {
  int r = 0;
  for (; r + kLanes * kRows <= rows; r += kLanes * kRows)
    subtract_tile<kRows, kColumns>(depth, a + r, s, stride, c + r, c_stride);
  if constexpr (kRows > 2) {
    for (; r + 2 * kLanes <= rows; r += 2 * kLanes)
      subtract_tile<2, kColumns>(depth, a + r, s, stride, c + r, c_stride);
  }
  for (; r < rows; r += kLanes)
    subtract_tile<1, kColumns>(depth, a + r, s, stride, c + r, c_stride);
}

/// L D L^T of one diagonal block; its diagonal becomes 1/d.
PivotCount factor_block(double* block, std::ptrdiff_t stride, const double* scales) {
  PivotCount count;
  double scaled[kBlock];
  for (int c = 0; c < kBlock; ++c) {
    double* const column = block + c * stride;
    double pivot = column[c];
    const double least = kVanishingPivot * scales[c];
    if (!(std::abs(pivot) > least)) {
      ++count.vanishing;
      pivot = least > 0 ? least : 1;
    } else if (pivot > 0) {
      ++count.positive;
    } else {
      ++count.negative;
    }
    const double inverse = 1 / pivot;
    for (int r = c + 1; r < kBlock; ++r) scaled[r] = column[r];
    for (int r = c + 1; r < kBlock; ++r) column[r] *= inverse;
    for (int k = c + 1; k < kBlock; ++k) {
      double* const later = block + k * stride;
      const double factor = column[k];
      for (int r = k; r < kBlock; ++r) later[r] -= scaled[r] * factor;
    }
    column[c] = inverse;
  }
  return count;
}

/// Rows below a factored diagonal block: scaled = rows L^-T, rows = scaled D^-1.
void divide_rows(const double* block, double* rows, double* scaled, int count,
                 std::ptrdiff_t stride) {
  double lower[kBlock][kBlock];
  double inverse[kBlock];
  for (int c = 0; c < kBlock; ++c) {
    inverse[c] = block[c * stride + c];
    for (int r = c + 1; r < kBlock; ++r) lower[r][c] = block[c * stride + r];
  }
  for (int r = 0; r < count; r += kLanes) {
    Lanes x[kBlock];
    for (int c = 0; c < kBlock; ++c) x[c] = *reinterpret_cast<const Lanes*>(rows + c * stride + r);
    // Each result is used at once, so that no sum waits for the one before it.
    for (int k = 0; k < kBlock; ++k) {
      for (int c = k + 1; c < kBlock; ++c) x[c] -= x[k] * lower[c][k];
    }
    for (int c = 0; c < kBlock; ++c) {
      *reinterpret_cast<Lanes*>(scaled + c * stride + r) = x[c];
      *reinterpret_cast<Lanes*>(rows + c * stride + r) = x[c] * inverse[c];
    }
  }
}

}  // namespace

PivotCount eliminate_columns(double* panel, double* scaled, const double* scales, int size,
                             int columns) {
  const std::ptrdiff_t stride = front_stride(size);
  PivotCount count;
  for (int first = 0; first < columns; first += kBlock) {
    double* const block = panel + first * stride + first;
    for (int c = 0; c < kBlock && first > 0; c += 3) {
      subtract_strip<4, 3>(size - first, first, panel + first, scaled + first + c, stride,
                           block + c * stride, stride);
    }
    count += factor_block(block, stride, scales + first);
    divide_rows(block, block + kBlock, scaled + first * stride + first + kBlock,
                size - first - kBlock, stride);
  }
  return count;
}

void update_remainder(const double* panel, const double* scaled, int size, int columns,
                      double* remainder) {
  const std::ptrdiff_t stride = front_stride(size);
  const int rows = size - columns;
  const std::ptrdiff_t own_stride = front_stride(rows);
  for (int c = 0; c < rows; c += kLanes) {
    subtract_strip<3, 4>(rows - c, columns, panel + columns + c, scaled + columns + c, stride,
                         remainder + c * own_stride + c, own_stride);
  }
}

void substitute_forward(const double* panel, int size, int columns, double* values) {
  const std::ptrdiff_t stride = front_stride(size);
  for (int first = 0; first < columns; first += kBlock) {
    const double* const block = panel + first * stride;
    double known[kBlock];
    for (int c = 0; c < kBlock; ++c) {
      known[c] = values[first + c];
      for (int r = c + 1; r < kBlock; ++r)
        values[first + r] -= block[c * stride + first + r] * known[c];
    }
    int r = first + kBlock;
    for (; r + kLanes <= size; r += kLanes) {
      Lanes sum = *reinterpret_cast<const Lanes*>(values + r);
      for (int c = 0; c < kBlock; ++c)
        sum -= *reinterpret_cast<const Lanes*>(block + c * stride + r) * known[c];
      *reinterpret_cast<Lanes*>(values + r) = sum;
    }
    for (; r < size; ++r) {
      for (int c = 0; c < kBlock; ++c) values[r] -= block[c * stride + r] * known[c];
    }
  }
}

void substitute_backward(const double* panel, int size, int columns, double* values) {
  const std::ptrdiff_t stride = front_stride(size);
  for (int first = columns - kBlock; first >= 0; first -= kBlock) {
    const double* const block = panel + first * stride;
    Lanes sums[kBlock] = {};
    int r = first + kBlock;
    for (; r + kLanes <= size; r += kLanes) {
      const Lanes given = *reinterpret_cast<const Lanes*>(values + r);
      for (int c = 0; c < kBlock; ++c)
        sums[c] += *reinterpret_cast<const Lanes*>(block + c * stride + r) * given;
    }
    for (int c = kBlock - 1; c >= 0; --c) {
      const double* const column = block + c * stride;
      double sum = (sums[c][0] + sums[c][2]) + (sums[c][1] + sums[c][3]);
      for (int k = r; k < size; ++k) sum += column[k] * values[k];
      for (int k = c + 1; k < kBlock; ++k) sum += column[first + k] * values[first + k];
      values[first + c] = values[first + c] * column[first + c] - sum;
    }
  }
}

}  // namespace limber::detail
