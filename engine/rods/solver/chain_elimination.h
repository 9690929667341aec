#pragma once

#include <cstddef>

#include "engine/base/numerics/pivot_count.h"
#include "engine/rods/solver/chain_batches.h"
#include "engine/rods/solver/lanes.h"

// Elimination of the unknowns of four chains at once: a window of 18 rows moves along the chain,
//
//   [ pivots x_j, theta_j | x_(j+1), theta_(j+1), x_(j+2) | the seven numbers of the start joint ]
//          4 (or theta_1)                 7                                7
//
// and its remainder after the last block is the chain's matrix as seen from its joints.

namespace limber::rods::detail {

inline constexpr std::ptrdiff_t kAhead = 7;  // rows below the pivots
inline constexpr std::ptrdiff_t kWindow = kChainBlock + kAhead + kTerminalSize;  // 18
/// Lanes that an eliminated block leaves: for each pivot the window's column of L, with 1/d in
/// place of its unit diagonal.
inline constexpr std::ptrdiff_t kBlockFactor = kChainBlock * kWindow;

/// Changes of a chain's pivots before elimination.
struct ChainAdjustment {
  const Lanes* shift = nullptr;  // added to the diagonal, by number; null: nothing
  const Lanes* keep = nullptr;   // 1, or 0 for a pinned number; null: none is pinned
};

/// The matrix of four chains over the numbers of their joints: finish, then start; lower triangle.
struct ChainRemainder {
  Lanes entries[2 * kTerminalSize][2 * kTerminalSize];  // [column][row]
};

/// @param band     of the batch, see CondensedMatrix
/// @param factor   end_block() - first_block() times kBlockFactor lanes, written
/// @param remainder  written
/// @returns pivots of the batch's chains, empty lanes and padding left out
[[nodiscard]] PivotCount eliminate_chains(const ChainBatch& batch, const Lanes* band,
                                          const ChainAdjustment& adjustment, Lanes* factor,
                                          ChainRemainder& remainder);

/// Forward substitution.
/// @param numbers  right-hand side by number, with room for kTerminalSize + 1 more. On entry the
/// numbers of the joints are zero; on return they hold the joints' share, the others L^-1 b
void substitute_forward(const ChainBatch& batch, const Lanes* factor, Lanes* numbers);

/// Backward substitution: numbers of the joints are known, the others hold L^-1 b.
void substitute_backward(const ChainBatch& batch, const Lanes* factor, Lanes* numbers);

}  // namespace limber::rods::detail
