#pragma once

#include "engine/rods/rod/length_weights.h"
#include "engine/rods/rod/material_frame.h"

// Kernel: bending and twisting at one interior vertex, for a scalar, a SIMD pack or a Dual.
//
// The energy depends on how the frame after the vertex is turned against the frame before it, and
// on nothing else. One moment vector and one symmetric 3 x 3 matrix therefore hold the whole
// gradient and Hessian:
//   d E = moment . (omega_after - omega_before).
// The rotation of a frame is omega. With left rotations exp(omega^x) of both frames
//   d^2 E = omega^T stiffness omega - moment . (omega_before x omega_after),
//   omega = omega_after - omega_before.
// `edge_stiffness.h` turns these into derivatives by edge vectors and angles. Equal to the formulas
// of (rod linkages, sec. 4 to 5.2), with two numbers per vertex where those have matrices for every
// strain and pair of edges.

namespace limber::rods {

/// Integrated strains of a vertex. The curvatures kappa_1 = (kappa b) . d2, kappa_2 = -(kappa b) .
/// d1 are in the frames before and after it (rod linkages, sec. 5.2). The twist is in [rad].
template <class V>
struct VertexStrains {
  V before_1;
  V before_2;
  V after_1;
  V after_2;
  V twist;
};

template <class V>
struct VertexKinematics {
  VertexStrains<V> strains;
  Vec3<V> axis;  // t_after x t_before
  V inverse;     // 1 / chi, chi = 1 + t_before . t_after
};

template <class V>
struct VertexMaterial {
  V bending_1;  // B_1, against kappa_1 (about d2) [force length^2]
  V bending_2;  // B_2
  V torsion;    // G J
  LengthWeights<V> weights;
  VertexStrains<V> rest;
};

template <class V>
struct VertexEnergy {
  V bending;
  V twisting;
};

/// The twist from one material frame to the next, in the branch nearest to `expected`. No transport
/// is needed: (R21 - R12) and (R11 + R22) of the relative rotation are chi sin m and chi cos m.
template <class V>
[[gnu::always_inline]] inline V material_twist(const MaterialFrame<V>& before,
                                               const MaterialFrame<V>& after, const V& expected) {
  const V cosine = dot(before.d1, after.d1) + dot(before.d2, after.d2);
  const V sine = dot(before.d2, after.d1) - dot(before.d1, after.d2);
  return rotations::nearest_turn(rotations::angle_of(cosine, sine), expected);
}

/// @param twist  of `material_twist`. Edges folded back onto each other (chi = 0) have no finite
/// curvature: the results are not finite there.
template <class V>
[[gnu::always_inline]] inline VertexKinematics<V> vertex_kinematics(const MaterialFrame<V>& before,
                                                                    const MaterialFrame<V>& after,
                                                                    const V& twist) {
  const Vec3<V> sum = before.tangent + after.tangent;
  const V inverse = 2.0 / dot(sum, sum);  // keeps its digits where the edges nearly fold back
  const V twice = inverse + inverse;
  return {
      {twice * dot(before.d1, after.tangent), twice * dot(before.d2, after.tangent),
       -(twice * dot(after.d1, before.tangent)), -(twice * dot(after.d2, before.tangent)), twist},
      cross(after.tangent, before.tangent),
      inverse};
}

/// d E / d strain for every strain.
template <class V>
[[gnu::always_inline]] inline VertexStrains<V> vertex_stresses(const VertexStrains<V>& strains,
                                                               const VertexMaterial<V>& material) {
  const LengthWeights<V>& w = material.weights;
  const VertexStrains<V>& r = material.rest;
  const V before_1 = strains.before_1 - r.before_1, after_1 = strains.after_1 - r.after_1;
  const V before_2 = strains.before_2 - r.before_2, after_2 = strains.after_2 - r.after_2;
  return {material.bending_1 * (w.before * before_1 + w.both * after_1),
          material.bending_2 * (w.before * before_2 + w.both * after_2),
          material.bending_1 * (w.after * after_1 + w.both * before_1),
          material.bending_2 * (w.after * after_2 + w.both * before_2),
          material.torsion * w.twist * (strains.twist - r.twist)};
}

template <class V>
[[gnu::always_inline]] inline VertexEnergy<V> vertex_energy(const VertexStrains<V>& strains,
                                                            const VertexStrains<V>& stresses,
                                                            const VertexStrains<V>& rest) {
  return {0.5 * (stresses.before_1 * (strains.before_1 - rest.before_1) +
                 stresses.before_2 * (strains.before_2 - rest.before_2) +
                 stresses.after_1 * (strains.after_1 - rest.after_1) +
                 stresses.after_2 * (strains.after_2 - rest.after_2)),
          0.5 * stresses.twist * (strains.twist - rest.twist)};
}

/// Directions and sums that moment and stiffness share.
template <class V>
struct VertexStressVectors {
  Vec3<V> before;  // stress_1 d1 + stress_2 d2 of the frame before
  Vec3<V> after;
  V work;              // sum of stress times curvature
  Vec3<V> bending;     // the bending part of the moment
  Vec3<V> twist_axis;  // d twist / d omega = (t_before + t_after) / chi
};

template <class V>
[[gnu::always_inline]] inline VertexStressVectors<V> vertex_stress_vectors(
    const MaterialFrame<V>& before, const MaterialFrame<V>& after, const VertexKinematics<V>& k,
    const VertexStrains<V>& stresses) {
  const Vec3<V> n0 = stresses.before_1 * before.d1 + stresses.before_2 * before.d2;
  const Vec3<V> n1 = stresses.after_1 * after.d1 + stresses.after_2 * after.d2;
  const V work = stresses.before_1 * k.strains.before_1 + stresses.before_2 * k.strains.before_2 +
                 stresses.after_1 * k.strains.after_1 + stresses.after_2 * k.strains.after_2;
  const Vec3<V> bending =
      k.inverse * (V(2.0) * (cross(after.tangent, n0) + cross(before.tangent, n1)) - work * k.axis);
  return {n0, n1, work, bending, k.inverse * (before.tangent + after.tangent)};
}

/// The moment that the frame after the vertex feels [force length]; the frame before it feels the
/// opposite.
template <class V>
[[gnu::always_inline]] inline Vec3<V> vertex_moment(const VertexStressVectors<V>& n,
                                                    const VertexStrains<V>& stresses) {
  return n.bending + stresses.twist * n.twist_axis;
}

/// d kappa / d omega for the curvature along one director.
template <class V>
[[gnu::always_inline]] inline Vec3<V> curvature_slope(const VertexKinematics<V>& k,
                                                      const Vec3<V>& other_tangent,
                                                      const Vec3<V>& director, const V& strain) {
  return k.inverse * (V(2.0) * cross(other_tangent, director) - strain * k.axis);
}
/// Slopes before and after, squared and weighted.
template <class V>
[[gnu::always_inline]] inline Sym3<V> weighted_squares(const V& stiffness,
                                                       const LengthWeights<V>& w,
                                                       const Vec3<V>& before,
                                                       const Vec3<V>& after) {
  return stiffness * (w.before * square(before) + w.after * square(after) +
                      w.both * symmetric_product(before, after));
}

/// Stresses of bending times second derivatives of the curvatures.
template <class V>
[[gnu::always_inline]] inline Sym3<V> curvature_stiffness(const Vec3<V>& t0, const Vec3<V>& t1,
                                                          const VertexKinematics<V>& k,
                                                          const VertexStressVectors<V>& n) {
  const Vec3<V> half = n.before - (0.5 * n.work) * t0;
  return k.inverse * (symmetric_product(half, t1) - symmetric_product(t0, n.after) -
                      symmetric_product(n.bending, k.axis) - scaled_identity(n.work));
}
template <class V>
[[gnu::always_inline]] inline Sym3<V> twist_stiffness(const VertexKinematics<V>& k,
                                                      const VertexStressVectors<V>& n,
                                                      const V& stress,
                                                      const VertexMaterial<V>& material) {
  return (material.torsion * material.weights.twist) * square(n.twist_axis) -
         (0.5 * k.inverse * stress) * symmetric_product(n.twist_axis, k.axis);
}

template <class V>
[[gnu::always_inline]] inline Sym3<V> vertex_stiffness(const MaterialFrame<V>& before,
                                                       const MaterialFrame<V>& after,
                                                       const VertexKinematics<V>& k,
                                                       const VertexStressVectors<V>& n,
                                                       const VertexStrains<V>& stresses,
                                                       const VertexMaterial<V>& material) {
  const Vec3<V>&t0 = before.tangent, &t1 = after.tangent;
  const VertexStrains<V>& s = k.strains;
  Sym3<V> result = weighted_squares(material.bending_1, material.weights,
                                    curvature_slope(k, t1, before.d1, s.before_1),
                                    curvature_slope(k, t0, after.d1, s.after_1));
  result += weighted_squares(material.bending_2, material.weights,
                             curvature_slope(k, t1, before.d2, s.before_2),
                             curvature_slope(k, t0, after.d2, s.after_2));
  result += (material.torsion * material.weights.twist) * square(n.twist_axis);
  // Stresses times second derivatives of the strains.
  const Vec3<V> half = n.before - (0.5 * n.work) * t0;
  const Vec3<V> turned = n.bending + (0.5 * stresses.twist) * n.twist_axis;
  result += k.inverse * (symmetric_product(half, t1) - symmetric_product(t0, n.after) -
                         symmetric_product(turned, k.axis) - scaled_identity(n.work));
  return result;
}

}  // namespace limber::rods
