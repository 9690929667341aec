#pragma once

#include <array>
#include <cmath>
#include <experimental/simd>
#include <type_traits>

#include "engine/base/numerics/dual.h"

// Coefficients of the exponential map of so(3) and of its first derivative, one branch-free formula
// for a scalar and for a SIMD pack. Written in the half angle m = n/2, where nothing cancels: the
// closed forms in n lose all digits at small n (measured table in the papers' errata, "the switch
// of sec. 2.3 is not robust").

namespace limber::rotations {

namespace stdx = std::experimental;

/// As many values of T as one register holds.
template <class T>
using Pack = stdx::native_simd<T>;

namespace detail {

template <class V>
struct ScalarOf {
  using type = typename V::value_type;
};
template <>
struct ScalarOf<double> {
  using type = double;
};
template <>
struct ScalarOf<float> {
  using type = float;
};
template <class V>
using Scalar = typename ScalarOf<V>::type;

template <class T>
inline constexpr T kPiLow = T(0);  // pi minus its nearest T
template <>
inline constexpr double kPiLow<double> = 1.2246467991473532e-16;
template <>
inline constexpr float kPiLow<float> = -8.74227766e-8F;

constexpr double factorial(int k) { return k <= 1 ? 1.0 : k * factorial(k - 1); }

// Taylor coefficients in the square of the angle: sin(r)/r, cos(r), (r cos r - sin r)/r^3 and
// -(3 r cos r + (r^2 - 3) sin r)/r^5, which is the derivative of the one before, over r; and that
// once more.
constexpr int kTerms = 13;
constexpr std::array<std::array<double, kTerms>, 5> taylor_coefficients() {
  std::array<std::array<double, kTerms>, 5> result{};
  for (int k = 0; k < kTerms; ++k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    result[0][k] = sign / factorial(2 * k + 1);
    result[1][k] = sign / factorial(2 * k);
    result[2][k] = -sign * (2 * k + 2) / factorial(2 * k + 3);
    result[3][k] = sign * (2 * k + 2) * (2 * k + 4) / factorial(2 * k + 5);
    result[4][k] = -sign * (2 * k + 2) * (2 * k + 4) * (2 * k + 6) / factorial(2 * k + 7);
  }
  return result;
}
inline constexpr auto kTaylor = taylor_coefficients();

template <int kSeries, int kCount, class V>
[[gnu::always_inline]] inline V taylor(const V& x) {
  using T = Scalar<V>;
  V sum = V(T(kTaylor[kSeries][kCount - 1]));
  for (int k = kCount - 2; k >= 0; --k) sum = sum * x + T(kTaylor[kSeries][k]);
  return sum;
}

template <class V, class Mask>
[[gnu::always_inline]] inline V select(const Mask& condition, const V& yes, const V& no) {
  if constexpr (std::is_same_v<Mask, bool>) {
    return condition ? yes : no;
  } else {
    V result = no;
    stdx::where(condition, result) = yes;
    return result;
  }
}

// Of the half angle m: cos m, sin m / m, the derivative of the latter by m over m.
template <class V>
struct HalfAngle {
  V m2;
  V cosine;
  V sinc;
  V slope;
};

template <class V>
[[gnu::always_inline]] inline HalfAngle<V> half_angle(const V& squared_angle) {
  using T = Scalar<V>;
  using std::floor;
  using std::sqrt;
  constexpr bool kIsDouble = sizeof(T) == 8;
  constexpr T kPi = T(3.14159265358979323846L);
  constexpr T kInversePi = T(0.31830988618379067154L);
  constexpr T kTiny = T(1e-30);  // any angle this small has the coefficients of zero

  const V m2 = T(0.25) * select<V>(squared_angle > kTiny, squared_angle, V(kTiny));
  const V m = sqrt(m2);
  const V turns = floor(m * kInversePi + T(0.5));
  const V r = (m - turns * kPi) - turns * kPiLow<T>;
  const V sign = T(1) - T(2) * (turns - T(2) * floor(turns * T(0.5)));
  const V r2 = r * r;
  const V cosine = sign * taylor < 1, kIsDouble ? 13 : 8 > (r2);
  const V sinc = sign * r * taylor < 0, kIsDouble ? 12 : 7 > (r2) / m;

  // (m cos m - sin m) / m^3: the series below m = 1, the closed form above, where it loses less
  // than two bits.
  const V near = taylor < 2, kIsDouble ? 10 : 6 > (m2);
  const V far = (cosine - sinc) / m2;
  return {m2, cosine, sinc, select<V>(m2 < T(1), near, far)};
}

}  // namespace detail

/// With n the angle: R = I + sine W + cosine W^2 for W = theta^x, and the derivatives of the two by
/// n, over n.
template <class V>
struct ExponentialCoefficients {
  V sine;               // sin n / n
  V cosine;             // (1 - cos n) / n^2
  V sine_derivative;    // (n cos n - sin n) / n^3
  V cosine_derivative;  // (2 cos n - 2 + n sin n) / n^4
};

/// @param squared_angle  n^2 >= 0, finite. Good to a few units in the last place for n in [0, pi];
/// beyond, the error
///   stays a few times the rounding of n itself.
template <class V>
[[gnu::always_inline]] inline ExponentialCoefficients<V> exponential_coefficients(
    const V& squared_angle) {
  using T = detail::Scalar<V>;
  const auto [m2, cosine, sinc, slope] = detail::half_angle(squared_angle);
  return {sinc * cosine, T(0.5) * sinc * sinc, T(0.25) * (slope * cosine - sinc * sinc),
          T(0.25) * sinc * slope};
}

/// The same and the second derivatives by n (the derivative of the derivative over n, over n).
template <class V>
struct SecondExponentialCoefficients {
  ExponentialCoefficients<V> first;
  V sine_second;    // -(3 n cos n + (n^2 - 3) sin n) / n^5
  V cosine_second;  // (8 + (n^2 - 8) cos n - 5 n sin n) / n^6
};

namespace detail {
// Derivatives of the half angle's slope by m, over m, once and twice. Closed forms lose two bits
// where the series end, m^2 = 6 (n = 4.9), and less beyond.
template <class V>
[[gnu::always_inline]] inline V second_slope(const HalfAngle<V>& h) {
  return select<V>(h.m2 < 6.0, taylor<3, 13>(h.m2), -(3.0 * h.slope + h.sinc) / h.m2);
}
template <class V>
[[gnu::always_inline]] inline V third_slope(const HalfAngle<V>& h, const V& second) {
  return select<V>(h.m2 < 6.0, taylor<4, 13>(h.m2), -(5.0 * second + h.slope) / h.m2);
}
template <class V>
[[gnu::always_inline]] inline SecondExponentialCoefficients<V> second_coefficients(
    const HalfAngle<V>& h, const V& second) {
  return {{h.sinc * h.cosine, 0.5 * h.sinc * h.sinc, 0.25 * (h.slope * h.cosine - h.sinc * h.sinc),
           0.25 * h.sinc * h.slope},
          0.0625 * (second * h.cosine - 3.0 * h.sinc * h.slope),
          0.0625 * (h.slope * h.slope + h.sinc * second)};
}
}  // namespace detail

/// Accuracy as for `exponential_coefficients`: in the half angle neither is a difference. V: double
/// or a pack of them.
template <class V>
[[gnu::always_inline]] inline SecondExponentialCoefficients<V> second_exponential_coefficients(
    const V& squared_angle) {
  const auto h = detail::half_angle(squared_angle);
  return detail::second_coefficients(h, detail::second_slope(h));
}

/// The same with derivatives along a direction, for third derivatives of rotations.
template <class V>
[[gnu::always_inline]] inline SecondExponentialCoefficients<Dual<V>>
second_exponential_coefficients(const Dual<V>& squared_angle) {
  const auto h = detail::half_angle(squared_angle.value);
  const V second = detail::second_slope(h);
  const V third = detail::third_slope(h, second);
  const auto [first, sine_second, cosine_second] = detail::second_coefficients(h, second);
  const V sine_third =
      0.015625 * (third * h.cosine - 4.0 * h.sinc * second - 3.0 * h.slope * h.slope);
  const V cosine_third = 0.015625 * (3.0 * h.slope * second + h.sinc * third);
  const V d = 0.5 * squared_angle.derivative;  // d/d n^2 is half the derivative by n, over n
  return {{{first.sine, first.sine_derivative * d},
           {first.cosine, first.cosine_derivative * d},
           {first.sine_derivative, sine_second * d},
           {first.cosine_derivative, cosine_second * d}},
          {sine_second, sine_third * d},
          {cosine_second, cosine_third * d}};
}

}  // namespace limber::rotations
