#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace limber::detail {

/// One dense step of a multifrontal factorisation: `columns` are eliminated together; the remainder
/// couples `rows` and goes to the parent. Numbers are nodes of the graph; positions in the front
/// count columns first, then rows.
struct Front {
  std::vector<int> columns;
  std::vector<int> rows;  // eliminated later, in the order of elimination
  int parent = -1;
  std::vector<int> children;
  std::vector<int> places;  // position of each row in the parent's front

  [[nodiscard]] int size() const { return static_cast<int>(columns.size() + rows.size()); }
};

/// Fronts of a graph for one order of elimination, children before parents.
///
/// Columns that share their rows are one front; a front also swallows a child where the zeros that
/// it then factors cost less than passing the child's remainder on.
struct FrontTree {
  std::vector<Front> fronts;
  double cost = 0;  // multiplications of blocks, overheads of fronts included
};

[[nodiscard]] FrontTree build_front_tree(int nodes, const std::vector<std::pair<int, int>>& edges,
                                         const std::vector<int>& order);

/// That of the cheapest of the known orders.
[[nodiscard]] FrontTree cheapest_front_tree(int nodes,
                                            const std::vector<std::pair<int, int>>& edges);

/// Multiplications of blocks to eliminate `columns` of a front of `size`.
[[nodiscard]] double front_cost(double columns, double size);

}  // namespace limber::detail
