#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/rods/solver/lanes.h"

// Between numbers in a row, chain by chain, and the same numbers of four chains side by side.

namespace limber::rods::detail {

/// Four numbers in a row from memory, wherever they lie.
using LooseLanes [[gnu::vector_size(8 * kChainLanes), gnu::aligned(8), gnu::may_alias]] = double;

/// Rows become columns.
[[gnu::always_inline]] inline void transpose(Lanes (&block)[kChainLanes]) {
  static_assert(kChainLanes == 4);
  using Places [[gnu::vector_size(8 * kChainLanes)]] = std::int64_t;
  const Lanes even_0 = __builtin_shuffle(block[0], block[1], Places{0, 4, 2, 6});
  const Lanes odd_0 = __builtin_shuffle(block[0], block[1], Places{1, 5, 3, 7});
  const Lanes even_1 = __builtin_shuffle(block[2], block[3], Places{0, 4, 2, 6});
  const Lanes odd_1 = __builtin_shuffle(block[2], block[3], Places{1, 5, 3, 7});
  block[0] = __builtin_shuffle(even_0, even_1, Places{0, 1, 4, 5});
  block[1] = __builtin_shuffle(odd_0, odd_1, Places{0, 1, 4, 5});
  block[2] = __builtin_shuffle(even_0, even_1, Places{2, 3, 6, 7});
  block[3] = __builtin_shuffle(odd_0, odd_1, Places{2, 3, 6, 7});
}

/// Four numbers in a row of each chain, as lanes.
[[gnu::always_inline]] inline void load_across(const double* const (&chains)[kChainLanes],
                                               std::ptrdiff_t first,
                                               Lanes (&numbers)[kChainLanes]) {
  for (int lane = 0; lane < kChainLanes; ++lane)
    numbers[lane] = *reinterpret_cast<const LooseLanes*>(chains[lane] + first);
  transpose(numbers);
}

}  // namespace limber::rods::detail
