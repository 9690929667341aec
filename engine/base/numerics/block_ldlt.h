#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "engine/base/numerics/pivot_count.h"

namespace limber {

/// A = L D L^T of a symmetric matrix of 9 x 9 blocks on the edges of a graph. The factorisation is
/// multifrontal, with dense kernels of our own and without pivoting, so that indefinite matrices
/// give their inertia.
///
/// The order of elimination and all memory are fixed by the graph; factor() neither allocates nor
/// depends on the number of threads. Independent parts of the elimination tree run in parallel.
class BlockLdlt {
 public:
  static constexpr int kBlock = 9;
  static constexpr int kEntries = kBlock * kBlock;

  /// @param edges  pairs of different nodes; repeated ones add up
  BlockLdlt(int nodes, const std::vector<std::pair<int, int>>& edges);
  ~BlockLdlt();
  BlockLdlt(BlockLdlt&&) noexcept;
  BlockLdlt& operator=(BlockLdlt&&) noexcept;

  [[nodiscard]] int nodes() const noexcept;
  [[nodiscard]] int size() const noexcept { return kBlock * nodes(); }
  [[nodiscard]] std::size_t factor_entries() const noexcept;  // of L, in doubles

  /// Values to write before factor(): 81 numbers each, column-major; of a diagonal block the upper
  /// triangle is not read. Rows of an edge's block belong to its first node, columns to its second.
  [[nodiscard]] double* diagonal(int node) noexcept;
  [[nodiscard]] double* coupling(int edge) noexcept;

  [[nodiscard]] PivotCount factor();

  /// x <- A^-1 x, size() numbers in the order of the nodes. Not from several threads at once.
  void solve_in_place(double* x);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber
