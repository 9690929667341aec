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

/// Rows of `count` numbers, one for each chain (null: zeros), as lanes.
[[gnu::always_inline]] inline void gather_rows(const double* const (&rows)[kChainLanes], int count,
                                               Lanes* numbers) {
  int k = 0;
  for (; k + kChainLanes <= count; k += kChainLanes) {
    Lanes block[kChainLanes] = {};
    for (int lane = 0; lane < kChainLanes; ++lane)
      if (rows[lane] != nullptr) block[lane] = *reinterpret_cast<const LooseLanes*>(rows[lane] + k);
    transpose(block);
    for (int i = 0; i < kChainLanes; ++i) numbers[k + i] = block[i];
  }
  for (; k < count; ++k) {
    Lanes number = {};
    for (int lane = 0; lane < kChainLanes; ++lane)
      if (rows[lane] != nullptr) number[lane] = rows[lane][k];
    numbers[k] = number;
  }
}

/// The inverse; nothing is written to null.
[[gnu::always_inline]] inline void scatter_rows(const Lanes* numbers, int count,
                                                double* const (&rows)[kChainLanes]) {
  int k = 0;
  for (; k + kChainLanes <= count; k += kChainLanes) {
    Lanes block[kChainLanes] = {numbers[k], numbers[k + 1], numbers[k + 2], numbers[k + 3]};
    transpose(block);
    for (int lane = 0; lane < kChainLanes; ++lane)
      if (rows[lane] != nullptr) *reinterpret_cast<LooseLanes*>(rows[lane] + k) = block[lane];
  }
  for (; k < count; ++k) {
    for (int lane = 0; lane < kChainLanes; ++lane)
      if (rows[lane] != nullptr) rows[lane][k] = numbers[k][lane];
  }
}

}  // namespace limber::rods::detail
