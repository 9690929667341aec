#include "engine/rods/rod/rod_hessian.h"

#include "engine/rods/rod/rod_passes.h"

namespace limber::rods {

using namespace passes;

HessianBlocks hessian_blocks(SlotArray values) {
  HessianBlocks result;
  result.values_ = std::move(values);
  return result;
}

EdgeBlock<double> HessianBlocks::edge(int slot) const {
  const auto v = [&](int field) { return values_(slot, field); };
  return {
      {v(kEdgeEe), v(kEdgeEe + 1), v(kEdgeEe + 2), v(kEdgeEe + 3), v(kEdgeEe + 4), v(kEdgeEe + 5)},
      {v(kEdgeEt), v(kEdgeEt + 1), v(kEdgeEt + 2)},
      v(kEdgeTt)};
}

CrossBlock<double> HessianBlocks::cross(int slot) const {
  const auto vec = [&](int field) {
    return Vec3<double>{values_(slot, field), values_(slot, field + 1), values_(slot, field + 2)};
  };
  return {{{vec(kCrossEe), vec(kCrossEe + 3), vec(kCrossEe + 6)}},
          vec(kCrossEt),
          vec(kCrossTe),
          values_(slot, kCrossTt)};
}

Eigen::MatrixXd banded(const RodLayout& layout, const HessianBlocks& blocks) {
  Eigen::MatrixXd band = Eigen::MatrixXd::Zero(kRodBandwidth + 1, layout.unknowns());
  for_each_entry(layout, blocks,
                 [&](int row, int column, double value) { band(row - column, column) += value; });
  return band;
}

}  // namespace limber::rods
