#pragma once

#include "engine/base/rotations/angles.h"
#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/linkage/terminal_edge.h"

// Kernel: the terminal edges of four segments at one end as functions of their joints' unknowns,
// and derivatives back to those. It is exact for rotation vectors up to pi, for a pack or a Dual of
// it.

namespace limber::rods::detail {

/// A joint as one of its segments sees it, before its unknowns change.
struct JointLanes {
  Vec3<ChainLane> position, normal, bisector;
  ChainLane angle, length;
  ChainLane half;  // -1/2 for rod A, +1/2 for rod B
  ChainLane sign;  // does the segment run along the rod's tangent
};

/// Changes of the unknowns that matter to it.
template <class T>
struct JointChange {
  Vec3<T> position, rotation;
  T angle, length;
};

template <class T>
struct TerminalLanes {
  Vec3<T> first, second;
  Vec3<T> tangent;  // of the segment
  Vec3<T> normal;
  Vec3<T> director;  // d_1
  T length;
};

/// sin r / r, (1 - cos r) / r^2 and (r - sin r) / r^3 of r^2.
template <class T>
struct RotationSeries {
  explicit RotationSeries(const T& square) {
    sine = half_angle_series(square, 0);
    const T half = half_angle_series(T(0.25) * square, 0);
    versine = T(0.5) * half * half;
    constexpr int kCount = 12;
    rest = T(-rotations::detail::kTaylor[0][kCount]);
    for (int k = kCount - 1; k >= 1; --k)
      rest = rest * square - T(rotations::detail::kTaylor[0][k]);
  }
  T sine, versine, rest;
};

template <class T>
Vec3<T> constant(const Vec3<ChainLane>& v) {
  return {T(v.x), T(v.y), T(v.z)};
}

template <class T>
TerminalLanes<T> terminal_lanes(const JointLanes& joint, const JointChange<T>& change) {
  const Vec3<T>& w = change.rotation;
  const RotationSeries<T> series(dot(w, w));
  const auto turned = [&](const Vec3<T>& v) {
    const Vec3<T> once = cross(w, v);
    return v + series.sine * once + series.versine * cross(w, once);
  };
  const auto share = rotations::cosine_sine(T(joint.half) * (T(joint.angle) + change.angle));
  const Vec3<T> normal = constant<T>(joint.normal);
  const Vec3<T> bisector = constant<T>(joint.bisector);
  TerminalLanes<T> result;
  result.tangent =
      turned(T(joint.sign) * (share.cosine * bisector + share.sine * cross(normal, bisector)));
  result.normal = turned(normal);
  result.director = cross(result.normal, result.tangent);
  result.length = T(joint.length) + change.length;
  const Vec3<T> half = (T(0.5) * result.length) * result.tangent;
  const Vec3<T> centre = constant<T>(joint.position) + change.position;
  result.first = centre - half;
  result.second = centre + half;
  return result;
}

/// Derivatives by the joint's unknowns from those by the edge's vertices and the spin of its frame.
template <class T>
JointChange<T> terminal_gradient(const JointLanes& joint, const JointChange<T>& change,
                                 const TerminalLanes<T>& edge, const Vec3<T>& by_first,
                                 const T& by_spin, const Vec3<T>& by_second) {
  const Vec3<T> force = T(0.5) * (by_second - by_first);
  const Vec3<T> moment = edge.length * cross(edge.tangent, force) + by_spin * edge.tangent;
  const Vec3<T>& w = change.rotation;
  const RotationSeries<T> series(dot(w, w));
  const Vec3<T> once = cross(w, moment);
  return {by_first + by_second, moment - series.versine * once + series.rest * cross(w, once),
          T(joint.half) * dot(edge.normal, moment), dot(force, edge.tangent)};
}

}  // namespace limber::rods::detail
