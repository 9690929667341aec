#pragma once

#include <cstddef>

#include "engine/base/numerics/pivot_count.h"

// Dense kernels of the multifrontal factorisation L D L^T with blocks of nine.

namespace limber::detail {

inline constexpr int kBlock = 9;

/// Doubles from one column of a front to the next: room for a vector beyond the last row, and no
/// distance that maps all columns to the same cache lines.
[[nodiscard]] constexpr std::ptrdiff_t front_stride(int rows) {
  const std::ptrdiff_t padded = (rows + 3) / 4 * 4 + 4;
  return padded % 32 == 0 ? padded + 4 : padded;
}

/// Eliminates the first columns of a symmetric matrix of which they are given in full height.
///
///   panel   stride x columns: lower triangle on entry; unit lower L on return, its diagonal
///           replaced by 1/d
///   scaled  stride x columns: L D below the diagonal blocks, on return
///   scales  size of each diagonal entry, to tell a vanishing pivot
///
/// Strides are front_stride(size); entries beyond row `size` are scratch.
/// @param size     rows, a multiple of kBlock
/// @param columns  a multiple of kBlock, <= size
[[nodiscard]] PivotCount eliminate_columns(double* panel, double* scaled, const double* scales,
                                           int size, int columns);

/// remainder -= L D L^T over the rows below the columns, on and below the diagonal.
/// @param remainder  of stride front_stride(size - columns); a few entries above the diagonal and
/// beyond its last row are scratch
void update_remainder(const double* panel, const double* scaled, int size, int columns,
                      double* remainder);

/// The two halves of a solve within one front, by an eliminated panel.
/// @param values  size numbers: columns first. Forward, they become L^-1 b and the remainder for
/// the rows below; backward, those of the columns become D^-1 y - L^T x with the rows' x given
void substitute_forward(const double* panel, int size, int columns, double* values);
void substitute_backward(const double* panel, int size, int columns, double* values);

}  // namespace limber::detail
