#include "engine/rods/rod/rod_layout.h"

#include <string>

#include "engine/base/error.h"

namespace limber::rods {

RodLayout::RodLayout(const std::vector<int>& edges_of_rod) : first_{0} {
  if (edges_of_rod.empty())
    throw Error(ErrorCode::kInvalidArgument, "rods", "at least one rod is needed");
  for (std::size_t r = 0; r < edges_of_rod.size(); ++r) {
    if (edges_of_rod[r] < 1) {
      throw Error(ErrorCode::kInvalidArgument, "rods[" + std::to_string(r) + "].edges",
                  "a rod needs at least one edge, got " + std::to_string(edges_of_rod[r]));
    }
    first_.push_back(first_.back() + edges_of_rod[r] + 1);
  }
  // The sweep over vertices reads two slots past its last register and writes one.
  const Eigen::Index registers = (first_.back() + kLaneWidth - 1) / kLaneWidth;
  activity_ = SlotArray::Zero(registers * kLaneWidth + kLaneWidth + 2, 2);
  for (int r = 0; r < rods(); ++r) {
    const int first = first_node(r);
    activity_.col(0).segment(first, edges(r)).setOnes();
    activity_.col(1).segment(first + 1, edges(r) - 1).setOnes();
  }
}

}  // namespace limber::rods
