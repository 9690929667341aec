#pragma once

#include "engine/base/rotations/exponential_entries.h"

// g(y) and its derivative for a scalar or a SIMD pack V: one lane per (tet, pose). See
// rs_coordinates.h for the layout of y; matrices are arrays of nine, column by column.

namespace limber::reduced {

/// Column index into y of strain entry (i, j).
inline constexpr int kStrainEntry[3][3] = {{3, 8, 7}, {8, 4, 6}, {7, 6, 5}};

/// out[9] = displacement gradient whose antisymmetric and symmetric parts are y.
template <class V>
[[gnu::always_inline]] inline void rs_linear_gradient(const V* y, V* out) {
  out[0] = y[3];
  out[1] = y[8] + y[2];
  out[2] = y[7] - y[1];
  out[3] = y[8] - y[2];
  out[4] = y[4];
  out[5] = y[6] + y[0];
  out[6] = y[7] + y[1];
  out[7] = y[6] - y[0];
  out[8] = y[5];
}

/// y[9] of a displacement gradient h[9].
template <class V>
[[gnu::always_inline]] inline void rs_of_gradient_entries(const V* h, V* y) {
  using T = rotations::detail::Scalar<V>;
  const T half(0.5);
  y[0] = half * (h[5] - h[7]);
  y[1] = half * (h[6] - h[2]);
  y[2] = half * (h[1] - h[3]);
  y[3] = h[0];
  y[4] = h[4];
  y[5] = h[8];
  y[6] = half * (h[5] + h[7]);
  y[7] = half * (h[2] + h[6]);
  y[8] = half * (h[1] + h[3]);
}

/// rotation[9] = exp(theta^x) - I and g[9] = (R - I) s + s + (R - I); also returns the coefficients
/// for derivatives.
template <class V>
[[gnu::always_inline]] inline rotations::ExponentialCoefficients<V> rs_gradient_entries(const V* y,
                                                                                        V* rotation,
                                                                                        V* g) {
  const auto k = rotations::exponential_coefficients<V>(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
  rotations::exponential_entries<V>(k, y, rotation);
  for (int j = 0; j < 3; ++j) {
    const V &s0 = y[kStrainEntry[0][j]], &s1 = y[kStrainEntry[1][j]], &s2 = y[kStrainEntry[2][j]];
    for (int i = 0; i < 3; ++i) {
      g[3 * j + i] = rotation[i] * s0 + rotation[3 + i] * s1 + rotation[6 + i] * s2 +
                     (rotation[3 * j + i] + y[kStrainEntry[i][j]]);
    }
  }
  return k;
}

/// out[9] = d g / d theta_axis = (d R / d theta_axis) (I + s).
template <int kAxis, class V>
[[gnu::always_inline]] inline void rs_rotation_column(
    const rotations::ExponentialCoefficients<V>& k, const V* y, V* out) {
  V d[9];
  rotations::exponential_derivative_entries<kAxis, V>(k, y, d);
  for (int j = 0; j < 3; ++j) {
    const V &s0 = y[kStrainEntry[0][j]], &s1 = y[kStrainEntry[1][j]], &s2 = y[kStrainEntry[2][j]];
    for (int i = 0; i < 3; ++i)
      out[3 * j + i] = d[i] * s0 + d[3 + i] * s1 + d[6 + i] * s2 + d[3 * j + i];
  }
}

/// out[9] = g(y) - g'(0) y, the part of second and higher order, without cancellation: (sine - 1) W
/// + cosine W^2 + (R - I) s.
template <class V>
[[gnu::always_inline]] inline void rs_remainder_entries(const V* y, V* out) {
  using T = rotations::detail::Scalar<V>;
  auto k = rotations::exponential_coefficients<V>(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
  V rotation[9];
  rotations::exponential_entries<V>(k, y, rotation);
  k.sine -= T(1);
  rotations::exponential_entries<V>(k, y, out);
  for (int j = 0; j < 3; ++j) {
    const V &s0 = y[kStrainEntry[0][j]], &s1 = y[kStrainEntry[1][j]], &s2 = y[kStrainEntry[2][j]];
    for (int i = 0; i < 3; ++i) {
      out[3 * j + i] += rotation[i] * s0 + rotation[3 + i] * s1 + rotation[6 + i] * s2;
    }
  }
}

}  // namespace limber::reduced
