#pragma once

#include <Eigen/Core>

#include "engine/base/numerics/vec3.h"

namespace limber::rotations {

/// The smallest rotation that takes the unit vector `from` to the unit vector `to`, applied to a
/// vector (rod linkages, sec. 4.3):
///   P v = (from . to) v + (from x to) x v + (from x to) ((from x to) . v) / (1 + from . to).
/// Opposite vectors have no smallest rotation, and P is not finite there. 1 + from . to is computed
/// as |from + to|^2 / 2, which keeps its relative accuracy up to there.
template <class V>
class ParallelTransport {
 public:
  [[gnu::always_inline]] inline ParallelTransport(const Vec3<V>& from, const Vec3<V>& to)
      : axis_(cross(from, to)), cosine_(dot(from, to)) {
    const Vec3<V> sum = from + to;
    inverse_ = 2.0 / dot(sum, sum);
  }
  [[nodiscard, gnu::always_inline]] inline Vec3<V> operator()(const Vec3<V>& v) const {
    const V along = dot(axis_, v) * inverse_;
    return cosine_ * v + cross(axis_, v) + along * axis_;
  }
  /// Spin of the transported frame about `to` per change of `to`: omega . to = spin . d(to).
  [[nodiscard, gnu::always_inline]] inline Vec3<V> spin() const { return -(inverse_ * axis_); }

 private:
  Vec3<V> axis_;
  V cosine_;
  V inverse_;
};

/// @pre unit vectors, not opposite to within `kNearlyOpposite` (see are_opposite)
[[nodiscard]] inline Eigen::Vector3d parallel_transport(const Eigen::Vector3d& from,
                                                        const Eigen::Vector3d& to,
                                                        const Eigen::Vector3d& v) {
  const auto vec = [](const Eigen::Vector3d& a) { return Vec3<double>{a.x(), a.y(), a.z()}; };
  const Vec3<double> r = ParallelTransport<double>(vec(from), vec(to))(vec(v));
  return {r.x, r.y, r.z};
}

/// For unit vectors this close to opposite (|from + to|, about the difference of their angle from
/// pi), the axis of the rotation between them has lost half of its digits.
inline constexpr double kNearlyOpposite = 1e-8;
[[nodiscard]] inline bool are_opposite(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return !((from + to).norm() > kNearlyOpposite);
}

}  // namespace limber::rotations
