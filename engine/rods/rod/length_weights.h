#pragma once

// How much of a rod's length an interior vertex stands for, in both discretisations of bending.

namespace limber::rods {

/// Forms of the discrete bending energy (rod linkages, sec. 5.2). In kMaterialFrames (2008, that of
/// the public code for linkages) it is the energy of each adjacent edge's frame, weighted by half
/// that edge's rest length. In kAveragedFrames (2010) it is the energy of the averaged curvatures.
/// Both measure curvature as 2 tan(phi / 2), phi the angle between the edges. The default
/// kTurningAngle is kMaterialFrames with phi itself, exact for circular arcs however long their
/// edges, and finite where edges fold back.
enum class BendingForm { kMaterialFrames, kAveragedFrames, kTurningAngle };
inline constexpr BendingForm kDefaultBending = BendingForm::kTurningAngle;

/// Factors of the energy of one interior vertex,
///   E = sum_a B_a/2 (before k0^2 + after k1^2 + 2 both k0 k1) + GJ/2 twist m^2,
/// with k0, k1 the integrated curvature about axis a in the frames of the edge before and after it.
/// The integrated twist is m; both are minus the rest. All in 1/length.
template <class V>
struct LengthWeights {
  V before;
  V after;
  V both;
  V twist;
};

/// @param rest_before, rest_after  rest lengths of the two edges, positive
template <class V>
[[nodiscard, gnu::always_inline]] inline LengthWeights<V> length_weights(const V& rest_before,
                                                                         const V& rest_after,
                                                                         BendingForm form) {
  const V inverse = 1.0 / (rest_before + rest_after);
  if (form == BendingForm::kAveragedFrames) {
    const V quarter = 0.5 * inverse;
    return {quarter, quarter, quarter, 2.0 * inverse};
  }
  const V share = 2.0 * inverse * inverse;
  return {rest_before * share, rest_after * share, V(0.0), 2.0 * inverse};
}

}  // namespace limber::rods
