#pragma once

#include "engine/base/rotations/exponential_coefficients.h"

// Entries of exp(theta^x) - I and of its derivatives for a scalar or a SIMD pack V, for kernels
// that fuse them with what follows. Matrices are arrays of nine, column by column.

namespace limber::rotations {

/// out[9] = exp(theta^x) - I, without the rounding of an identity added and taken away.
template <class V>
[[gnu::always_inline]] inline void exponential_entries(const ExponentialCoefficients<V>& k,
                                                       const V* theta, V* out) {
  const V &x = theta[0], &y = theta[1], &z = theta[2];
  const V ax = k.sine * x, ay = k.sine * y, az = k.sine * z;
  const V bx = k.cosine * x, by = k.cosine * y, bz = k.cosine * z;
  const V xx = bx * x, yy = by * y, zz = bz * z, xy = bx * y, xz = bx * z, yz = by * z;
  out[0] = -(yy + zz);
  out[1] = xy + az;
  out[2] = xz - ay;
  out[3] = xy - az;
  out[4] = -(xx + zz);
  out[5] = yz + ax;
  out[6] = xz + ay;
  out[7] = yz - ax;
  out[8] = -(xx + yy);
}

/// out[9] = d exp(theta^x) / d theta_axis, axis 0..2:
///   sine' t_k W + sine E_k + cosine' t_k W^2 + cosine (E_k W + W E_k), W = theta^x, E_k = e_k^x.
template <int kAxis, class V>
[[gnu::always_inline]] inline void exponential_derivative_entries(
    const ExponentialCoefficients<V>& k, const V* theta, V* out) {
  using T = detail::Scalar<V>;
  const V &x = theta[0], &y = theta[1], &z = theta[2];
  const V& t = theta[kAxis];
  const V cx = k.sine_derivative * t * x, cy = k.sine_derivative * t * y,
          cz = k.sine_derivative * t * z;
  const V d = k.cosine_derivative * t;
  const V dx = d * x, dy = d * y;
  const V xx = dx * x, yy = dy * y, zz = d * z * z, xy = dx * y, xz = dx * z, yz = dy * z;
  out[0] = -(yy + zz);
  out[1] = xy + cz;
  out[2] = xz - cy;
  out[3] = xy - cz;
  out[4] = -(xx + zz);
  out[5] = yz + cx;
  out[6] = xz + cy;
  out[7] = yz - cx;
  out[8] = -(xx + yy);
  // E_k
  constexpr int kNext = (kAxis + 1) % 3;
  constexpr int kLast = (kAxis + 2) % 3;
  out[kNext * 3 + kLast] += k.sine;
  out[kLast * 3 + kNext] -= k.sine;
  // E_k W + W E_k = theta e_k^T + e_k theta^T - 2 theta_k I
  const V bn = k.cosine * theta[kNext], bl = k.cosine * theta[kLast], b2 = T(2) * k.cosine * t;
  out[kAxis * 3 + kNext] += bn;
  out[kNext * 3 + kAxis] += bn;
  out[kAxis * 3 + kLast] += bl;
  out[kLast * 3 + kAxis] += bl;
  out[kNext * 3 + kNext] -= b2;
  out[kLast * 3 + kLast] -= b2;
}

}  // namespace limber::rotations
