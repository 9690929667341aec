#pragma once

#include "engine/base/numerics/vec3.h"
#include "engine/base/rotations/angles.h"
#include "engine/base/rotations/parallel_transport.h"

// Kernel: the material frame of one edge, for a scalar, a SIMD pack or a Dual of either.

namespace limber::rods {

/// An edge e = x_after - x_before and its orthonormal material frame (d1, d2, tangent).
template <class V>
struct MaterialFrame {
  Vec3<V> tangent;
  V length;
  Vec3<V> d1;
  Vec3<V> d2;
  /// Turn of the frame about its tangent by the finite transport from the source frame, per change
  /// of e: to spin = d theta + transport . de [1/length]. Zero at the source frame.
  Vec3<V> transport;
};

/// @param source_tangent, source_director  unit and orthogonal. The director is transported to the
/// present tangent and turned about it by theta [rad]: d1 = cos theta P d + sin theta t x P d
template <class V>
[[gnu::always_inline]] inline MaterialFrame<V> material_frame(const Vec3<V>& before,
                                                              const Vec3<V>& after, const V& theta,
                                                              const Vec3<V>& source_tangent,
                                                              const Vec3<V>& source_director) {
  const Vec3<V> edge = after - before;
  const V length = norm(edge);
  const V inverse = 1.0 / length;
  const Vec3<V> tangent = inverse * edge;
  const rotations::ParallelTransport<V> transport(source_tangent, tangent);
  const Vec3<V> reference = transport(source_director);
  const Vec3<V> second = cross(tangent, reference);
  const auto k = rotations::cosine_sine(theta);
  return {tangent, length, k.cosine * reference + k.sine * second,
          k.cosine * second - k.sine * reference, inverse * transport.spin()};
}

}  // namespace limber::rods
