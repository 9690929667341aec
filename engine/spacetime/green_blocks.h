#pragma once

#include <vector>

#include "engine/spacetime/banded_factor.h"

namespace limber::spacetime {

/// Blocks of the inverse of a banded system between some of its frames: diagonal in the modes, one
/// number per lane.
class GreenBlocks {
 public:
  /// @param columns  frames of the factored system
  /// @param frames   of these, ascending
  void compute(const BandedFactor& factor, int columns, int lanes, const std::vector<int>& frames);

  /// @param i, j  places in `frames`
  [[nodiscard]] const double* operator()(int i, int j) const;

 private:
  std::size_t lanes_ = 0;
  std::vector<double> values_;  // [i][j <= i][lane]
};

}  // namespace limber::spacetime
