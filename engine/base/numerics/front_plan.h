#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace limber::detail {

/// Destination of a block of the matrix in a front: block row `row` of block column `column`.
struct BlockSource {
  enum class Kind { kDiagonal, kCoupling, kTransposedCoupling };
  Kind kind;
  std::size_t offset;  // of its 81 numbers among the diagonals or couplings
  int column;
  int row;
};

/// A front with everything that its factorisation looks up. Counts are of blocks, offsets of
/// doubles.
struct PlannedFront {
  int columns = 0;
  int size = 0;            // columns + rows
  std::vector<int> nodes;  // size
  std::vector<int> children;
  std::vector<int> places;  // position of each row in the parent
  std::vector<BlockSource> sources;
  std::size_t panel = 0;  // in the factor
  std::size_t remainder =
      0;  // in the shared or in the task's memory; valid until the parent is done
  bool shares_remainder = false;  // of the top, and of the roots of tasks
};

/// Plan of the numeric factorisation: `tasks` are subtrees that may run in parallel, `top` the
/// fronts after them; fronts within each are in order.
struct FrontPlan {
  std::vector<PlannedFront> fronts;  // children first
  std::vector<std::vector<int>> tasks;
  std::vector<int> top;
  std::size_t panel_entries = 0;
  std::size_t shared_entries = 0;   // of remainders that outlive their task
  std::size_t task_entries = 0;     // of remainders within one task
  std::size_t scratch_entries = 0;  // of each factoring thread: widest_front sizes, then a panel
  std::size_t widest_front = 0;     // columns
};

/// Takes the cheaper of the known orderings.
[[nodiscard]] FrontPlan plan_fronts(int nodes, const std::vector<std::pair<int, int>>& edges);

}  // namespace limber::detail
