#pragma once

#include "engine/base/numerics/vec3.h"

// Kernel: stretching of one edge, for a scalar, a SIMD pack or a Dual:
//   E = stretching / 2 (l / rest - 1)^2 rest.
// The factor `stretching` is E A [force] times the density with which the edge counts. Two rods
// that share an edge at a joint of a linkage count it one half each.

namespace limber::rods {

template <class V>
struct Stretch {
  V energy;
  V tension;  // d E / d l
  V slope;    // d^2 E / d l^2
};

template <class V>
[[gnu::always_inline]] inline Stretch<V> stretch(const V& length, const V& rest_length,
                                                 const V& stretching) {
  const V slope = stretching / rest_length;
  const V change = length - rest_length;
  const V tension = slope * change;
  return {0.5 * tension * change, tension, slope};
}

/// d^2 E / d e^2 = slope t t^T + tension / l (I - t t^T).
template <class V>
[[gnu::always_inline]] inline Sym3<V> stretch_stiffness(const Stretch<V>& s, const Vec3<V>& tangent,
                                                        const V& length) {
  const V across = s.tension / length;
  return (s.slope - across) * square(tangent) + scaled_identity(across);
}

}  // namespace limber::rods
