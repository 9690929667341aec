#pragma once

#include <array>
#include <cmath>
#include <experimental/simd>
#include <type_traits>

// Coefficients of the exponential map of so(3) and of its first derivative, one branch-free formula
// for a scalar and for a SIMD pack. They are written in the half angle m = n/2, without
// cancellation. The closed forms in n lose all digits at small n (measured table in the papers'
// errata, "the switch of sec. 2.3 is not robust").

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

// Taylor coefficients in the square of the angle: sin(r)/r, cos(r) and (r cos r - sin r)/r^3.
constexpr int kTerms = 13;
constexpr std::array<std::array<double, kTerms>, 3> taylor_coefficients() {
  std::array<std::array<double, kTerms>, 3> result{};
  for (int k = 0; k < kTerms; ++k) {
    const double sign = k % 2 == 0 ? 1 : -1;
    result[0][k] = sign / factorial(2 * k + 1);
    result[1][k] = sign / factorial(2 * k);
    result[2][k] = -sign * (2 * k + 2) / factorial(2 * k + 3);
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

// Functions of the half angle m: cos m, sin m / m, the derivative of the latter by m over m.
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

}  // namespace limber::rotations
