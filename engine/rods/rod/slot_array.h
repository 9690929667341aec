#pragma once

#include <Eigen/Core>

#include "engine/base/numerics/dual.h"
#include "engine/base/numerics/vec3.h"
#include "engine/base/rotations/exponential_coefficients.h"

// Structure of arrays: a column per quantity, a row per slot of a RodLayout. Kernels run over rows,
// one SIMD register of them at a time.

namespace limber::rods {

using SlotArray = Eigen::MatrixXd;  // padded rows x fields

/// One register of slots.
using Lane = rotations::Pack<double>;
inline constexpr std::ptrdiff_t kLaneWidth = static_cast<std::ptrdiff_t>(Lane::size());

/// A slot array, and for Dual kernels the array of its derivatives; no derivatives: they are zero.
struct SlotsIn {
  const SlotArray* value = nullptr;
  const SlotArray* derivative = nullptr;
};
struct SlotsOut {
  SlotArray* value = nullptr;
  SlotArray* derivative = nullptr;
};

namespace detail {
[[gnu::always_inline]] inline Lane load_lane(const SlotArray& array, int field,
                                             std::ptrdiff_t row) {
  return Lane(array.data() + field * array.rows() + row, std::experimental::element_aligned);
}
[[gnu::always_inline]] inline void store_lane(SlotArray& array, int field, std::ptrdiff_t row,
                                              const Lane& lane) {
  lane.copy_to(array.data() + field * array.rows() + row, std::experimental::element_aligned);
}
}  // namespace detail

template <class V>
[[gnu::always_inline]] inline V load(const SlotsIn& slots, int field, std::ptrdiff_t row) {
  if constexpr (std::is_same_v<V, Lane>) {
    return detail::load_lane(*slots.value, field, row);
  } else {
    return {detail::load_lane(*slots.value, field, row),
            slots.derivative ? detail::load_lane(*slots.derivative, field, row) : Lane(0.0)};
  }
}
template <class V>
[[gnu::always_inline]] inline Vec3<V> load3(const SlotsIn& slots, int field, std::ptrdiff_t row) {
  return {load<V>(slots, field, row), load<V>(slots, field + 1, row),
          load<V>(slots, field + 2, row)};
}
template <class V>
[[gnu::always_inline]] inline Sym3<V> load6(const SlotsIn& slots, int field, std::ptrdiff_t row) {
  return {load<V>(slots, field, row),     load<V>(slots, field + 1, row),
          load<V>(slots, field + 2, row), load<V>(slots, field + 3, row),
          load<V>(slots, field + 4, row), load<V>(slots, field + 5, row)};
}

template <class V>
[[gnu::always_inline]] inline void store(const SlotsOut& slots, int field, std::ptrdiff_t row,
                                         const V& value) {
  if constexpr (std::is_same_v<V, Lane>) {
    detail::store_lane(*slots.value, field, row, value);
  } else {
    detail::store_lane(*slots.value, field, row, value.value);
    detail::store_lane(*slots.derivative, field, row, value.derivative);
  }
}
template <class V>
[[gnu::always_inline]] inline void store(const SlotsOut& slots, int field, std::ptrdiff_t row,
                                         const Vec3<V>& v) {
  store(slots, field, row, v.x);
  store(slots, field + 1, row, v.y);
  store(slots, field + 2, row, v.z);
}
template <class V>
[[gnu::always_inline]] inline void store(const SlotsOut& slots, int field, std::ptrdiff_t row,
                                         const Sym3<V>& a) {
  store(slots, field, row, a.xx);
  store(slots, field + 1, row, a.yx);
  store(slots, field + 2, row, a.yy);
  store(slots, field + 3, row, a.zx);
  store(slots, field + 4, row, a.zy);
  store(slots, field + 5, row, a.zz);
}

/// value where active > 1/2, else zero; inactive values may be anything, NaN too.
template <class V>
[[gnu::always_inline]] inline V where_active(const Lane& active, const V& value) {
  if constexpr (std::is_same_v<V, Lane>) {
    return rotations::detail::select<Lane>(active > 0.5, value, Lane(0.0));
  } else {
    return {where_active(active, value.value), where_active(active, value.derivative)};
  }
}
template <class V>
[[gnu::always_inline]] inline Vec3<V> where_active(const Lane& active, const Vec3<V>& v) {
  return {where_active(active, v.x), where_active(active, v.y), where_active(active, v.z)};
}
template <class V>
[[gnu::always_inline]] inline Sym3<V> where_active(const Lane& active, const Sym3<V>& a) {
  return {where_active(active, a.xx), where_active(active, a.yx), where_active(active, a.yy),
          where_active(active, a.zx), where_active(active, a.zy), where_active(active, a.zz)};
}

}  // namespace limber::rods
