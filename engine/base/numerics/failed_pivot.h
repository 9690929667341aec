#pragma once

#include <limits>

namespace limber::detail {

/// A pivot below this share of its diagonal entry is rounding noise: the matrix is singular in
/// double precision.
inline constexpr double kRelativePivot = 4 * std::numeric_limits<double>::epsilon();

/// Where a Cholesky factorisation ended.
struct FailedPivot {
  int row = 0;  // of the matrix
  /// Quiet NaN where only the row is known.
  double value = 0;
};

}  // namespace limber::detail
