#pragma once

#include "engine/base/degrees.h"
#include "engine/base/numerics/dual.h"
#include "engine/base/rotations/exponential_coefficients.h"

// Sine, cosine and the angle of a planar vector for a scalar, a SIMD pack or a Dual of either. The
// standard library calls its scalar functions lane by lane for packs.

namespace limber::rotations {

template <class V>
struct CosineSine {
  V cosine;
  V sine;
};

/// @param angle  [rad], below 1e8; absolute error a few ulps of one and half an ulp of the angle
template <class V>
[[gnu::always_inline]] inline CosineSine<V> cosine_sine(const V& angle) {
  using std::floor;
  // pi to 24 bits, whose multiples are exact, and the rest.
  constexpr double kPiHigh = 3.1415927410125732421875;
  constexpr double kPiRest = -8.7422780003724856617e-8;
  const V turns = floor(angle * 0.31830988618379067154 + 0.5);
  const V r = (angle - turns * kPiHigh) - turns * kPiRest;
  const V sign = 1.0 - 2.0 * (turns - 2.0 * floor(turns * 0.5));
  const V r2 = r * r;
  const V cosine = detail::taylor<1, 13>(r2);
  const V sine = detail::taylor<0, 12>(r2);
  return {sign * cosine, sign * r * sine};
}

template <class V>
[[gnu::always_inline]] inline CosineSine<Dual<V>> cosine_sine(const Dual<V>& angle) {
  const CosineSine<V> k = cosine_sine(angle.value);
  return {{k.cosine, -k.sine * angle.derivative}, {k.sine, k.cosine * angle.derivative}};
}

/// The angle of the vector (cosine, sine), in [-pi, pi] [rad]: atan2(sine, cosine). The vector need
/// not have unit length; NaN for the zero vector.
template <class V>
[[gnu::always_inline]] inline V angle_of(const V& cosine, const V& sine) {
  // Rational function of Moshier's Cephes library on [0, tan(pi/8)] after two reductions.
  constexpr double kHalfPi = 1.57079632679489661923;
  const V c = detail::select<V>(cosine < 0.0, -cosine, cosine);
  const V s = detail::select<V>(sine < 0.0, -sine, sine);
  const auto steep = s > c;
  const V large = detail::select<V>(steep, s, c);
  const V small = detail::select<V>(steep, c, s);
  const auto middle = small > large * 0.41421356237309504880;
  const V t = detail::select<V>(middle, small - large, small) /
              detail::select<V>(middle, small + large, large);
  const V z = t * t;
  const V p = (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z -
                7.500855792314704667340e1) *
                   z -
               1.228866684490136173410e2) *
                  z -
              6.485021904942025371773e1;
  const V q = ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z +
                4.328810604912902668951e2) *
                   z +
               4.853903996359136964868e2) *
                  z +
              1.945506571482613964425e2;
  V angle = t + t * z * (p / q);
  angle = detail::select<V>(middle, angle + 0.5 * kHalfPi, angle);
  angle = detail::select<V>(steep, kHalfPi - angle, angle);
  angle = detail::select<V>(cosine < 0.0, 2 * kHalfPi - angle, angle);
  return detail::select<V>(sine < 0.0, -angle, angle);
}

template <class V>
[[gnu::always_inline]] inline Dual<V> angle_of(const Dual<V>& cosine, const Dual<V>& sine) {
  const V length2 = cosine.value * cosine.value + sine.value * sine.value;
  return {angle_of(cosine.value, sine.value),
          (cosine.value * sine.derivative - sine.value * cosine.derivative) / length2};
}

/// angle plus the full turns that bring it nearest to `reference` [rad].
template <class V>
[[gnu::always_inline]] inline V nearest_turn(const V& angle, const V& reference) {
  using std::floor;
  return angle + kFullTurn * floor((reference - angle) * (1 / kFullTurn) + 0.5);
}
template <class V>
[[gnu::always_inline]] inline Dual<V> nearest_turn(const Dual<V>& angle, const Dual<V>& reference) {
  return {nearest_turn(angle.value, reference.value), angle.derivative};
}

}  // namespace limber::rotations
