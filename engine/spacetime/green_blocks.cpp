#include "engine/spacetime/green_blocks.h"

#include <algorithm>

namespace limber::spacetime {
namespace {

std::size_t triangle(int row, int column) {
  return static_cast<std::size_t>(row) * (static_cast<std::size_t>(row) + 1) / 2 +
         static_cast<std::size_t>(column);
}

}  // namespace

const double* GreenBlocks::operator()(int i, int j) const {
  return values_.data() + triangle(std::max(i, j), std::min(i, j)) * lanes_;
}

void GreenBlocks::compute(const BandedFactor& factor, int columns, int lanes,
                          const std::vector<int>& frames) {
  const int count = static_cast<int>(frames.size());
  lanes_ = static_cast<std::size_t>(lanes);
  values_.resize(triangle(count, 0) * lanes_);
  Lanes column(lanes, columns);
  for (int i = 0; i < count; ++i) {
    factor.inverse_column(frames[static_cast<std::size_t>(i)], column);
    for (int j = 0; j <= i; ++j) {
      std::copy_n(column.col(frames[static_cast<std::size_t>(j)]).data(), lanes,
                  values_.data() + triangle(i, j) * lanes_);
    }
  }
}

}  // namespace limber::spacetime
