#pragma once

#include <array>
#include <cmath>

#include "engine/base/rotations/angles.h"

// Kernel: atan(sqrt x) / sqrt x and its derivatives, for a scalar, a SIMD pack or a Dual of either.

namespace limber::rods {

namespace detail {

inline constexpr int kTurningTerms = 28;

/// Coefficients of z^k in (-1)^n (2 n + 1) / n! (1 + x)^(n + 1) f^(n)(x), z = x / (1 + x): all
/// positive.
template <int kDerivative>
constexpr std::array<double, kTurningTerms> turning_coefficients() {
  std::array<double, kTurningTerms> result{};
  result[0] = 1;
  for (int k = 1; k < kTurningTerms; ++k)
    result[k] = result[k - 1] * (kDerivative + k) / (kDerivative + k + 0.5);
  return result;
}

constexpr double turning_factor(int derivative) {
  double factor = 1.0 / (2 * derivative + 1);
  for (int k = 1; k <= derivative; ++k) factor *= -k;
  return factor;
}

/// 1 / (1 + x)^count.
template <class V>
[[gnu::always_inline]] inline V inverse_power(const V& inverse, int count) {
  V result = inverse;
  for (int k = 1; k < count; ++k) result = result * inverse;
  return result;
}

/// The series, for the range in which it is short enough: x <= 1/3, angles up to 60 degrees.
template <int kDerivative, class V>
[[gnu::always_inline]] inline V turning_series(const V& x, const V& inverse) {
  constexpr auto kCoefficients = turning_coefficients<kDerivative>();
  const V z = x * inverse;
  V sum = V(kCoefficients[kTurningTerms - 1]);
  for (int k = kTurningTerms - 2; k >= 0; --k) sum = sum * z + V(kCoefficients[k]);
  return turning_factor(kDerivative) * inverse_power(inverse, kDerivative + 1) * sum;
}

/// Elsewhere: 2 x f' + f = 1 / (1 + x), differentiated.
template <int kDerivative, class V>
[[gnu::always_inline]] inline V turning_recursion(const V& x, const V& inverse) {
  if constexpr (kDerivative == 0) {
    using std::sqrt;
    const V root = sqrt(x);
    return rotations::angle_of(V(1.0), root) / root;
  } else {
    constexpr int n = kDerivative - 1;
    const V right = (turning_factor(n) * (2 * n + 1)) * inverse_power(inverse, kDerivative);
    return (right - (2.0 * n + 1) * turning_recursion<n>(x, inverse)) / (2.0 * x);
  }
}

}  // namespace detail

/// The derivative of the given order of f(x) = atan(sqrt x) / sqrt x, x >= 0. With x the square of
/// tan(phi / 2), f is the ratio of phi to 2 tan(phi / 2). A few ulps, smooth at zero; order 4 keeps
/// three digits less.
template <int kDerivative, class V>
[[gnu::always_inline]] inline V turning_ratio(const V& x) {
  const V inverse = 1.0 / (1.0 + x);
  return rotations::detail::select<V>(x < 1.0 / 3, detail::turning_series<kDerivative>(x, inverse),
                                      detail::turning_recursion<kDerivative>(x, inverse));
}
template <int kDerivative, class V>
[[gnu::always_inline]] inline Dual<V> turning_ratio(const Dual<V>& x) {
  return {turning_ratio<kDerivative>(x.value),
          turning_ratio<kDerivative + 1>(x.value) * x.derivative};
}

}  // namespace limber::rods
