#pragma once

#include "engine/base/numerics/vec3.h"
#include "engine/base/rotations/exponential_coefficients.h"

// The beam element as a kernel: energy, moments and forces of one element or, with a SIMD pack for
// V, of several. See NOTATION.md for the derivation.

namespace limber::beams {

/// Constants of an element. Bending in a plane has the energy (near (u_a^2 + u_b^2) + 2 far u_a
/// u_b) / 2 of the end angles u beyond those at rest. Here near = 4 EI/L, far = 2 EI/L, or EI/L and
/// -EI/L if shear is released.
template <class V>
struct ElementConstants {
  V length = V(1.0);      // L, at rest, along the beam
  V stretching = V(0.0);  // EA/L; 0 where the axial force is released
  V torsion = V(0.0);     // GJ/L
  V near_2 = V(0.0), far_2 = V(0.0);
  V near_3 = V(0.0), far_3 = V(0.0);
  V bow = V(0.0);               // L/30; 0 for cables
  V rest_twist = V(0.0);        // [rad], of the measure q_1 (twist_measure)
  V rest_angle_2 = V(0.0);      // of the finish; the start has the opposite
  V rest_angle_3 = V(0.0);      //
  V least_stretch = V(-1e300);  // 0 for cables: no force below
};

/// The three axes of an end's section in space.
template <class V>
struct Triad {
  Vec3<V> x1, x2, x3;
};

/// 3 sin / (2 + cos) instead of the angle: no inverse functions, error phi^5 / 180, increasing up
/// to 120 degrees.
template <class V>
[[gnu::always_inline]] inline V bend_factor(const V& cosine) {
  return 3.0 / (2.0 + cosine);
}

/// How the chord lies in the frame of one end.
template <class V>
struct EndAngles {
  V c, s2, s3;         // chord direction by the axes of the end
  V factor;            // bend_factor(c)
  V inverse;           // 1 / (1 + c)
  V angle_2, angle_3;  // rotation of the end against the chord, about its axes 2 and 3

  [[gnu::always_inline]] inline EndAngles(const Vec3<V>& t, const Triad<V>& e)
      : c(dot(t, e.x1)),
        s2(dot(t, e.x2)),
        s3(dot(t, e.x3)),
        factor(bend_factor(c)),
        inverse(1.0 / (1.0 + c)),
        angle_2(factor * s3),
        angle_3(-factor * s2) {}

  /// Moment on the end, in its own axes, of moments against angle_2, angle_3 and of the twisting
  /// moment with its sign at this end.
  [[nodiscard, gnu::always_inline]] inline Vec3<V> moment(const V& m2, const V& m3,
                                                          const V& twisting) const {
    const V slope = factor * factor * (1.0 / 3.0);  // - d factor / d c
    const V mixed = slope * (m2 * s3 - m3 * s2);
    return {twisting - factor * (m2 * s2 + m3 * s3),
            factor * c * m2 + mixed * s3 + twisting * s2 * inverse,
            factor * c * m3 - mixed * s2 + twisting * s3 * inverse};
  }

  /// An axis of the end after the smallest rotation that takes x1 to the chord.
  [[nodiscard, gnu::always_inline]] inline Vec3<V> swung(const Triad<V>& e, const Vec3<V>& t,
                                                         const Vec3<V>& axis,
                                                         const V& along) const {
    return axis - (along * inverse) * (e.x1 + t);
  }
};

/// Measure of the twist angle: twice that of half of it, 6 sin / (2 + cos) of angle / 2. Error
/// angle^5 / 2880, increasing in all of (-pi, pi); beyond, it jumps: a turn slips through.
template <class V>
struct TwistMeasure {
  V half;   // cosine of half the angle
  V value;  // [rad]
  V slope;  // by the angle

  [[gnu::always_inline]] inline TwistMeasure(const V& sine, const V& cosine)
      : half(cosine_of_half(cosine)) {
    const V factor = bend_factor(half);
    value = factor * sine / half;
    slope = factor * factor * (1.0 / 3.0) * (1.0 + 2.0 * half);
  }

 private:
  [[gnu::always_inline]] static inline V cosine_of_half(const V& cosine) {
    using std::sqrt;
    const V square = 0.5 + 0.5 * cosine;
    return sqrt(rotations::detail::select<V>(square > V(1e-24), square, V(1e-24)));
  }
};

/// How far an element is from rest: the six natural modes.
template <class V>
struct NaturalModes {
  Vec3<V> t;  // chord
  V chord;    // its length
  EndAngles<V> start, finish;
  V sine, cosine;                          // of the twist angle
  V half;                                  // cosine of half the twist angle
  V twist;                                 // q_1, beyond rest
  V twist_slope;                           // d q_1 / d angle
  V start_2, finish_2, start_3, finish_3;  // u, beyond rest
  V stretch;                               // chord + bowing - L

  [[gnu::always_inline]] inline NaturalModes(const ElementConstants<V>& k, const Vec3<V>& d,
                                             const Triad<V>& a, const Triad<V>& b)
      : t(), chord(norm(d)), start(direction(d, chord, t), a), finish(t, b) {
    const Vec3<V> b2 = finish.swung(b, t, b.x2, finish.s2);
    sine = dot(start.swung(a, t, a.x3, start.s3), b2);
    cosine = dot(start.swung(a, t, a.x2, start.s2), b2);
    const TwistMeasure<V> measure(sine, cosine);
    half = measure.half;
    twist = measure.value - k.rest_twist;
    twist_slope = measure.slope;
    start_2 = start.angle_2 + k.rest_angle_2;
    finish_2 = finish.angle_2 - k.rest_angle_2;
    start_3 = start.angle_3 + k.rest_angle_3;
    finish_3 = finish.angle_3 - k.rest_angle_3;
    const V bowed = bowing(start.angle_2, finish.angle_2) + bowing(start.angle_3, finish.angle_3);
    const V all = chord - k.length + k.bow * bowed;
    stretch = rotations::detail::select<V>(all > k.least_stretch, all, V(0.0));
  }

 private:
  [[gnu::always_inline]] static inline const Vec3<V>& direction(const Vec3<V>& d, const V& length,
                                                                Vec3<V>& t) {
    t = (1.0 / length) * d;
    return t;
  }
  [[gnu::always_inline]] static inline V bowing(const V& a, const V& b) {
    return 2.0 * (a * a + b * b) - a * b;
  }
};

/// Response of an element.
template <class V>
struct ElementResponse {
  V axial, twisting;                       // N, and dU / d angle of twist
  V start_2, finish_2, start_3, finish_3;  // dU / d end angles
  Vec3<V> force;                           // dU / d position of the finish; start: minus this
  Vec3<V> start_moment, finish_moment;     // dU / d spin of the ends, in space

  [[gnu::always_inline]] inline ElementResponse(const ElementConstants<V>& k,
                                                const NaturalModes<V>& q, const Triad<V>& a,
                                                const Triad<V>& b) {
    axial = k.stretching * q.stretch;
    twisting = k.torsion * q.twist * q.twist_slope;
    const V pull = k.bow * axial;
    const EndAngles<V>&s = q.start, &f = q.finish;
    start_2 = k.near_2 * q.start_2 + k.far_2 * q.finish_2 + pull * (4.0 * s.angle_2 - f.angle_2);
    finish_2 = k.near_2 * q.finish_2 + k.far_2 * q.start_2 + pull * (4.0 * f.angle_2 - s.angle_2);
    start_3 = k.near_3 * q.start_3 + k.far_3 * q.finish_3 + pull * (4.0 * s.angle_3 - f.angle_3);
    finish_3 = k.near_3 * q.finish_3 + k.far_3 * q.start_3 + pull * (4.0 * f.angle_3 - s.angle_3);
    start_moment = in_space(a, s.moment(start_2, start_3, -twisting));
    finish_moment = in_space(b, f.moment(finish_2, finish_3, twisting));
    // No work in rigid rotations: the couple of the forces balances the moments.
    force = axial * q.t + (1.0 / q.chord) * cross(q.t, start_moment + finish_moment);
  }

 private:
  [[gnu::always_inline]] static inline Vec3<V> in_space(const Triad<V>& e, const Vec3<V>& m) {
    return m.x * e.x1 + m.y * e.x2 + m.z * e.x3;
  }
};

/// Energy by mode.
template <class V>
struct ElementEnergies {
  V stretching, torsion, bending_2, bending_3;

  [[gnu::always_inline]] inline ElementEnergies(const ElementConstants<V>& k,
                                                const NaturalModes<V>& q)
      : stretching(0.5 * k.stretching * q.stretch * q.stretch),
        torsion(0.5 * k.torsion * q.twist * q.twist),
        bending_2(plane(k.near_2, k.far_2, q.start_2, q.finish_2)),
        bending_3(plane(k.near_3, k.far_3, q.start_3, q.finish_3)) {}

  [[nodiscard]] V total() const { return stretching + torsion + bending_2 + bending_3; }

 private:
  [[gnu::always_inline]] static inline V plane(const V& near, const V& far, const V& a,
                                               const V& b) {
    return 0.5 * near * (a * a + b * b) + far * a * b;
  }
};

}  // namespace limber::beams
