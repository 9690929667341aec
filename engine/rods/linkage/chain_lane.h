#pragma once

#include <experimental/simd>

#include "engine/base/numerics/vec3.h"
#include "engine/rods/solver/lanes.h"

// Kernels of rods on four equal segments at once.

namespace limber::rods::detail {

/// One number of each of the four segments of a batch.
using ChainLane =
    std::experimental::simd<double, std::experimental::simd_abi::deduce_t<double, kChainLanes>>;

[[gnu::always_inline]] inline ChainLane load_lane(const double* cell) {
  return ChainLane(cell, std::experimental::element_aligned);
}
[[gnu::always_inline]] inline void store_lane(double* cell, const ChainLane& lane) {
  lane.copy_to(cell, std::experimental::element_aligned);
}
[[gnu::always_inline]] inline Vec3<ChainLane> load_lanes3(const double* cells) {
  return {load_lane(cells), load_lane(cells + kChainLanes), load_lane(cells + 2 * kChainLanes)};
}
[[gnu::always_inline]] inline void store_lanes3(double* cells, const Vec3<ChainLane>& v) {
  store_lane(cells, v.x);
  store_lane(cells + kChainLanes, v.y);
  store_lane(cells + 2 * kChainLanes, v.z);
}

}  // namespace limber::rods::detail
