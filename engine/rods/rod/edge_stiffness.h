#pragma once

#include "engine/rods/rod/vertex_element.h"

// Kernel: from moments and stiffnesses of vertices to derivatives by edge vectors e and angles
// theta, for a scalar, a SIMD pack or a Dual.
//
// Moving e by de and theta by dtheta turns the frame by
//   omega = t x de/l (1 - t . de/l) + dtheta t + dtheta/2 (de/l - t (t . de/l)) + O(3)
// (transport, then spin). In the second variation of `vertex_element.h` this gives the blocks
// below. The load on an edge is the sum over both vertices: the moment after minus before.

namespace limber::rods {

/// Derivatives by e (3) and theta of one edge.
template <class V>
struct EdgeGradient {
  Vec3<V> force;
  V torque;
};
template <class V>
struct EdgeBlock {
  Sym3<V> ee;
  Vec3<V> et;
  V tt;
};
/// Rows by (e, theta) of the edge before, columns by those of the edge after.
template <class V>
struct CrossBlock {
  Mat3<V> ee;
  Vec3<V> et;  // e before, theta after
  Vec3<V> te;  // theta before, e after
  V tt;
};

/// @param moment  of the vertex at the start of the edge minus that at its end
template <class V>
[[gnu::always_inline]] inline EdgeGradient<V> edge_gradient(const MaterialFrame<V>& edge,
                                                            const Vec3<V>& moment,
                                                            const V& tension) {
  const V torque = dot(moment, edge.tangent);
  return {(1.0 / edge.length) * cross(moment, edge.tangent) + torque * edge.transport +
              tension * edge.tangent,
          torque};
}

/// At the source frame. @param moment  as for `edge_gradient`; @param stiffness  of both vertices
template <class V>
[[gnu::always_inline]] inline EdgeBlock<V> edge_block(const MaterialFrame<V>& edge,
                                                      const Vec3<V>& moment,
                                                      const Sym3<V>& stiffness) {
  const Vec3<V>& t = edge.tangent;
  const V inverse = 1.0 / edge.length;
  const Vec3<V> at = stiffness * t;
  const V along = dot(t, at);
  const V trace = stiffness.xx + stiffness.yy + stiffness.zz;
  // [t]^T A [t] = tr(PAP) P - PAP with P = I - t t^T.
  const Sym3<V> turned = scaled_identity(trace - along) - stiffness +
                         symmetric_product(t, at - (0.5 * trace) * t - cross(moment, t));
  const Vec3<V> mixed = 0.5 * (moment - dot(moment, t) * t) - cross(t, at);
  return {(inverse * inverse) * turned, inverse * mixed, along};
}

/// At the source frame; moment and stiffness of the vertex between the edges.
template <class V>
[[gnu::always_inline]] inline CrossBlock<V> cross_block(const MaterialFrame<V>& before,
                                                        const MaterialFrame<V>& after,
                                                        const Vec3<V>& moment,
                                                        const Sym3<V>& stiffness) {
  const Vec3<V>&t0 = before.tangent, &t1 = after.tangent;
  const V inverse0 = 1.0 / before.length, inverse1 = 1.0 / after.length;
  // C = -A + [moment]/2: the second variation is omega_before^T C omega_after.
  const Vec3<V> half = 0.5 * moment;
  const Mat3<V> c_transposed{{{-stiffness.xx, -stiffness.yx - half.z, half.y - stiffness.zx},
                              {half.z - stiffness.yx, -stiffness.yy, -stiffness.zy - half.x},
                              {-stiffness.zx - half.y, half.x - stiffness.zy, -stiffness.zz}}};
  const Mat3<V> turned = transpose(cross(t1, c_transposed));  // -C [t1]
  const Vec3<V> c_t1 = cross(half, t1) - stiffness * t1;
  const Vec3<V> ct_t0 = c_transposed * t0;
  Mat3<V> ee = cross(t0, turned);
  const V scale = inverse0 * inverse1;
  for (auto& column : ee.column) column = scale * column;
  return {ee, -(inverse0 * cross(t0, c_t1)), -(inverse1 * cross(t1, ct_t0)), dot(t0, c_t1)};
}

/// Away from the source frame, the angle that the present frame sees is theta plus the holonomy of
/// the path source - edge before - edge now. Its gradient is `edge.transport`, its Hessian the
/// symmetric part of the derivative of that.
/// @param torque  of `edge_gradient`
template <class V>
[[gnu::always_inline]] inline EdgeBlock<V> transported(const EdgeBlock<V>& block,
                                                       const MaterialFrame<V>& edge,
                                                       const Vec3<V>& source_tangent,
                                                       const V& torque) {
  const Vec3<V>& k = edge.transport;
  const V c = dot(source_tangent, edge.tangent);
  const V bend = torque / (edge.length * (1.0 + c));
  const Vec3<V> direction = (2.0 + c) * edge.tangent + source_tangent;
  return {
      block.ee + symmetric_product(k, block.et + (0.5 * block.tt) * k - (0.5 * bend) * direction),
      block.et + block.tt * k, block.tt};
}
template <class V>
[[gnu::always_inline]] inline CrossBlock<V> transported(const CrossBlock<V>& block,
                                                        const Vec3<V>& transport_before,
                                                        const Vec3<V>& transport_after) {
  return {block.ee + outer(transport_before, block.te + block.tt * transport_after) +
              outer(block.et, transport_after),
          block.et + block.tt * transport_before, block.te + block.tt * transport_after, block.tt};
}

}  // namespace limber::rods
