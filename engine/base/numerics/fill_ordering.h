#pragma once

#include <utility>
#include <vector>

namespace limber {

enum class FillOrdering {
  kMinimumDegree,     // AMD
  kNestedDissection,  // METIS bisections down to a handful of nodes, constrained minimum degree
};

/// An order of elimination of an undirected graph's nodes that keeps the fill of its Cholesky
/// factor small: result[k] is the node eliminated as k-th. Deterministic.
/// @param edges  pairs of different nodes; repetitions are harmless
[[nodiscard]] std::vector<int> fill_reducing_order(int nodes,
                                                   const std::vector<std::pair<int, int>>& edges,
                                                   FillOrdering method);

}  // namespace limber
