#pragma once

#include <cmath>
#include <limits>
#include <optional>

namespace limber {

/// Shifts to try, one after the other.
struct ShiftSeries {
  double first;   // > 0
  double growth;  // from one to the next, > 1
  int max_trials = std::numeric_limits<int>::max();
};

/// The first shift of a growing series with which a matrix has a factor (Nocedal and Wright,
/// Numerical Optimization, algorithm 3.3).
/// @param factors  bool factors(shift); the factor of the last call is the one of the result
/// @returns nothing where no finite shift of the series serves
template <class Factors>
[[nodiscard]] std::optional<double> raise_shift(const ShiftSeries& series, Factors&& factors) {
  double shift = series.first;
  for (int trial = 0; trial < series.max_trials && std::isfinite(shift); ++trial) {
    if (factors(shift)) return shift;
    shift *= series.growth;
  }
  return {};
}

}  // namespace limber
