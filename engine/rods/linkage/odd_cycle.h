#pragma once

#include <array>
#include <string>
#include <vector>

namespace limber::rods::detail {

/// Says that two nodes are equal (parity 0) or opposite (1).
struct ParityLink {
  std::array<int, 2> nodes;
  int parity;
};

/// The nodes of a shortest cycle with an odd sum of parities, in order from its smallest; empty
/// where there is none. If there are several, it is the one through the smallest node. In large
/// graphs of long cycles the search ends after 2e7 steps with the shortest one so far.
[[nodiscard]] std::vector<int> shortest_odd_cycle(int nodes, const std::vector<ParityLink>& links);

/// "the joints at vertices 3, 5, 9 (from 0)", the first 12 of them.
[[nodiscard]] std::string loop_text(const std::vector<int>& vertices);

}  // namespace limber::rods::detail
