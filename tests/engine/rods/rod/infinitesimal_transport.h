#pragma once

#include "tests/engine/rods/rod/rod_samples.h"

// The gradients of (rod linkages, sec. 4.5, 4.6 and 5.2) for infinitesimal transport, strain by
// strain as the paper has them. The engine does not use them: frames that follow by infinitesimal
// transport make an energy that depends on the path.

namespace limber::rods::testing {

inline Eigen::Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

/// Bending and twisting part of the gradient at a state, for frames that follow infinitesimally.
inline Eigen::VectorXd infinitesimal_gradient(const RodState& state,
                                              const RodParameters& parameters) {
  const RodLayout& layout = state.layout();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(layout.unknowns());
  using P = RodParameters;
  for (int i = 1; i < layout.nodes(); ++i) {
    if (!layout.is_interior(i)) continue;
    const auto before = state.frame(i - 1), after = state.frame(i);
    const Eigen::Vector3d t0 = eigen(before.tangent), t1 = eigen(after.tangent);
    const double chi = 1 + t0.dot(t1);
    const Eigen::Vector3d kb = 2 * t0.cross(t1) / chi, tilde = (t0 + t1) / chi;
    const auto add = [&](double factor, const Eigen::Vector3d& by_before,
                         const Eigen::Vector3d& by_after) {
      result.segment<3>(4 * (i - 1)) -= factor * by_before;
      result.segment<3>(4 * i) += factor * (by_before - by_after);
      result.segment<3>(4 * (i + 1)) += factor * by_after;
    };
    const double l0 = parameters(i - 1, P::kRestLength), l1 = parameters(i, P::kRestLength);
    const double mean = 0.5 * (l0 + l1);
    for (const int side : {0, 1}) {
      const auto& f = side == 0 ? before : after;
      const Eigen::Vector3d d1 = eigen(f.d1), d2 = eigen(f.d2);
      const double weight = (side == 0 ? l0 : l1) / (2 * mean * mean);
      const double k1 = kb.dot(d2), k2 = -kb.dot(d1);
      const double s1 = weight * parameters(i, P::kBending1) *
                        (k1 - parameters(i, side == 0 ? P::kRestBefore1 : P::kRestAfter1));
      const double s2 = weight * parameters(i, P::kBending2) *
                        (k2 - parameters(i, side == 0 ? P::kRestBefore2 : P::kRestAfter2));
      add(s1, (2 / chi * t1.cross(d2) - k1 * tilde) / before.length,
          (-2 / chi * t0.cross(d2) - k1 * tilde) / after.length);
      add(s2, (-2 / chi * t1.cross(d1) - k2 * tilde) / before.length,
          (2 / chi * t0.cross(d1) - k2 * tilde) / after.length);
      result[4 * (i - 1 + side) + 3] -= s1 * kb.dot(d1) + s2 * kb.dot(d2);
    }
    const double s =
        parameters(i, P::kTorsion) / mean * (state.strains(i).twist - parameters(i, P::kRestTwist));
    add(s, kb / (2 * before.length), kb / (2 * after.length));
    result[4 * i + 3] += s;
    result[4 * (i - 1) + 3] -= s;
  }
  return result;
}

}  // namespace limber::rods::testing
