#pragma once

#include <cstddef>
#include <vector>

#include "engine/rods/solver/chain_batches.h"

namespace limber::rods::detail {

/// One number of each of four chains.
using Lanes [[gnu::vector_size(8 * kChainLanes), gnu::may_alias]] = double;

/// The same as plain doubles, on a vector's boundary.
struct alignas(8 * kChainLanes) LaneCell {
  double values[kChainLanes] = {};
};

/// Zeros at first.
class LaneBuffer {
 public:
  explicit LaneBuffer(std::size_t size) : cells_(size) {}
  [[nodiscard]] Lanes* data() { return reinterpret_cast<Lanes*>(cells_.data()); }
  [[nodiscard]] const Lanes* data() const { return reinterpret_cast<const Lanes*>(cells_.data()); }
  void fill(double value) {
    for (LaneCell& cell : cells_) {
      for (double& lane : cell.values) lane = value;
    }
  }

 private:
  std::vector<LaneCell> cells_;
};

}  // namespace limber::rods::detail
