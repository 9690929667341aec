#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/base/numerics/vec3.h"
#include "engine/base/rotations/exponential_coefficients.h"

namespace limber::rotations {

/// exp(omega^x) v and its derivatives by omega (rod linkages, sec. 2.2), for a scalar, a SIMD
/// pack or a Dual of either: the coefficients are computed once and serve every vector turned by
/// the same omega. With W = omega^x and k of `exponential_coefficients.h`: v + k.sine W v +
/// k.cosine W^2 v.
template <class V>
class Rotation {
 public:
  [[gnu::always_inline]] inline explicit Rotation(const Vec3<V>& omega)
      : omega_(omega), k_(second_exponential_coefficients(dot(omega, omega))) {}

  [[nodiscard, gnu::always_inline]] inline Vec3<V> operator()(const Vec3<V>& v) const {
    const Vec3<V> wv = cross(omega_, v);
    return v + k_.first.sine * wv + k_.first.cosine * cross(omega_, wv);
  }

  /// Column k: d/d omega_k.
  [[nodiscard, gnu::always_inline]] inline Mat3<V> derivative(const Vec3<V>& v) const {
    const Vec3<V> wv = cross(omega_, v);
    const Vec3<V> wwv = cross(omega_, wv);
    // sine' Wv omega^T - sine v^x + cosine' WWv omega^T + cosine (omega v^T - 2 v omega^T
    //   + (omega . v) I)
    const Vec3<V> along = k_.first.sine_derivative * wv + k_.first.cosine_derivative * wwv -
                          (2.0 * k_.first.cosine) * v;
    const V diagonal = k_.first.cosine * dot(omega_, v);
    const Vec3<V> sv = k_.first.sine * v;
    const Vec3<V> cv = k_.first.cosine * v;
    return outer(along, omega_) + outer(omega_, cv) +
           Mat3<V>{{{diagonal, -sv.z, sv.y}, {sv.z, diagonal, -sv.x}, {-sv.y, sv.x, diagonal}}};
  }

  /// weight . d^2/d omega^2, the Hessian of one linear form of the rotated vector.
  [[nodiscard, gnu::always_inline]] inline Sym3<V> second_derivative(const Vec3<V>& v,
                                                                     const Vec3<V>& weight) const {
    const Vec3<V> wv = cross(omega_, v);
    const Vec3<V> wwv = cross(omega_, wv);
    const Vec3<V> sine_slope = cross(v, weight);  // weight . (e_i x v) = (v x weight)_i
    const V ov = dot(omega_, v), ow = dot(omega_, weight), vw = dot(v, weight);
    const Vec3<V> cosine_slope = ov * weight + ow * v - (2.0 * vw) * omega_;
    const V s = dot(weight, wv);
    const V c = dot(weight, wwv);
    const Vec3<V> mixed = k_.first.sine_derivative * sine_slope +
                          k_.first.cosine_derivative * cosine_slope +
                          (0.5 * (k_.sine_second * s + k_.cosine_second * c)) * omega_;
    return symmetric_product(omega_, mixed) + k_.first.cosine * symmetric_product(v, weight) +
           scaled_identity<V>(k_.first.sine_derivative * s + k_.first.cosine_derivative * c -
                              2.0 * k_.first.cosine * vw);
  }

 private:
  Vec3<V> omega_;
  SecondExponentialCoefficients<V> k_;
};

/// d (exp(omega^x) v) / d omega, 3 x 3, column k by omega_k.
[[nodiscard]] Eigen::Matrix3d rotated_vector_derivative(const Eigen::Vector3d& omega,
                                                        const Eigen::Vector3d& v);

/// d^2 (exp(omega^x) v)_c / d omega^2: a symmetric 3 x 3 matrix for each component c.
[[nodiscard]] std::array<Eigen::Matrix3d, 3> rotated_vector_second_derivative(
    const Eigen::Vector3d& omega, const Eigen::Vector3d& v);

}  // namespace limber::rotations
