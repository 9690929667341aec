#pragma once

#include "engine/rods/rod/turning_ratio.h"
#include "engine/rods/rod/vertex_element.h"

// Kernel: energy, moment and stiffness of a vertex in every form of bending, for a scalar, a SIMD
// pack or a Dual.

namespace limber::rods {

enum class VertexOrder { kEnergy, kMoment, kStiffness };

/// How a form measures the curvature of a vertex: 2 tan(phi / 2) or phi. Known before loops over
/// vertices begin, so that the one does not slow the other down.
enum class CurvatureMeasure { kTangent, kAngle };

[[nodiscard]] inline CurvatureMeasure measure_of(BendingForm form) {
  return form == BendingForm::kTurningAngle ? CurvatureMeasure::kAngle : CurvatureMeasure::kTangent;
}

template <class V>
struct VertexResponse {
  VertexStrains<V> strains;  // as the form measures them
  VertexEnergy<V> energy;
  Vec3<V> moment;  // from kMoment on, see vertex_element.h
  Sym3<V> stiffness;
};

/// The curvatures kappa b times s = phi / (2 tan(phi / 2)), phi the angle between the edges: then
/// |kappa| = phi, which is exact for arcs with any edges. s is a function of the cosine c of
/// phi, whose derivatives are
///   dc = axis . omega,  d^2 c = omega . (sym(t_before t_after^T) - c I) omega - axis . (...),
/// and so d(s kappa) = s d kappa + kappa s' dc, and once more.
template <VertexOrder kOrder, class V>
[[gnu::noinline]] VertexResponse<V> turning_response(const MaterialFrame<V>& before,
                                                     const MaterialFrame<V>& after, const V& twist,
                                                     const VertexMaterial<V>& material) {
  const auto k = vertex_kinematics(before, after, twist);
  const V square_of_tangent = k.inverse * k.inverse * dot(k.axis, k.axis);
  const V s = turning_ratio<0>(square_of_tangent);
  VertexResponse<V> result;
  result.strains = {s * k.strains.before_1, s * k.strains.before_2, s * k.strains.after_1,
                    s * k.strains.after_2, twist};
  const auto stresses = vertex_stresses(result.strains, material);
  result.energy = vertex_energy(result.strains, stresses, material.rest);
  if constexpr (kOrder != VertexOrder::kEnergy) {
    const V inverse2 = k.inverse * k.inverse;
    const V by_square = turning_ratio<1>(square_of_tangent);
    const V slope = -2.0 * inverse2 * by_square;  // ds/dc
    const auto n = vertex_stress_vectors(before, after, k, stresses);
    result.moment = s * n.bending + (slope * n.work) * k.axis + stresses.twist * n.twist_axis;
    if constexpr (kOrder == VertexOrder::kStiffness) {
      const Vec3<V>&t0 = before.tangent, &t1 = after.tangent;
      const V bend =
          4.0 * inverse2 * (inverse2 * turning_ratio<2>(square_of_tangent) + k.inverse * by_square);
      const auto gradient = [&](const Vec3<V>& other, const Vec3<V>& director, const V& strain) {
        return s * curvature_slope(k, other, director, strain) + (slope * strain) * k.axis;
      };
      const VertexStrains<V>& raw = k.strains;
      Sym3<V>& a = result.stiffness;
      a = weighted_squares(material.bending_1, material.weights,
                           gradient(t1, before.d1, raw.before_1),
                           gradient(t0, after.d1, raw.after_1));
      a += weighted_squares(material.bending_2, material.weights,
                            gradient(t1, before.d2, raw.before_2),
                            gradient(t0, after.d2, raw.after_2));
      a += twist_stiffness(k, n, stresses.twist, material);
      a += s * curvature_stiffness(t0, t1, k, n);
      a += slope * symmetric_product(n.bending, k.axis);
      a += n.work * (bend * square(k.axis) +
                     slope * (0.5 * symmetric_product(t0, t1) - scaled_identity(dot(t0, t1))));
    }
  }
  return result;
}

/// @param twist  of `material_twist`
template <VertexOrder kOrder, CurvatureMeasure kMeasure, class V>
[[gnu::always_inline]] inline VertexResponse<V> vertex_response(const MaterialFrame<V>& before,
                                                                const MaterialFrame<V>& after,
                                                                const V& twist,
                                                                const VertexMaterial<V>& material) {
  if constexpr (kMeasure == CurvatureMeasure::kAngle) {
    return turning_response<kOrder>(before, after, twist, material);
  } else {
    const auto k = vertex_kinematics(before, after, twist);
    const auto stresses = vertex_stresses(k.strains, material);
    VertexResponse<V> result;
    result.strains = k.strains;
    result.energy = vertex_energy(k.strains, stresses, material.rest);
    if constexpr (kOrder != VertexOrder::kEnergy) {
      const auto n = vertex_stress_vectors(before, after, k, stresses);
      result.moment = vertex_moment(n, stresses);
      if constexpr (kOrder == VertexOrder::kStiffness)
        result.stiffness = vertex_stiffness(before, after, k, n, stresses, material);
    }
    return result;
  }
}

/// The same where a branch for each vertex does not matter.
template <VertexOrder kOrder, class V>
VertexResponse<V> vertex_response(const MaterialFrame<V>& before, const MaterialFrame<V>& after,
                                  const V& twist, const VertexMaterial<V>& material,
                                  BendingForm form) {
  if (measure_of(form) == CurvatureMeasure::kAngle)
    return vertex_response<kOrder, CurvatureMeasure::kAngle>(before, after, twist, material);
  return vertex_response<kOrder, CurvatureMeasure::kTangent>(before, after, twist, material);
}

}  // namespace limber::rods
