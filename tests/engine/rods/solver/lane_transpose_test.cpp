#include "engine/rods/solver/lane_transpose.h"

#include <gtest/gtest.h>

#include <vector>

namespace limber::rods::detail {
namespace {

/// Number k of chain c.
double number(int chain, int k) { return 100 * chain + k; }

TEST(LaneTranspose, RowsBecomeLanesAndRowsAgain) {
  for (const int count : {1, 3, 4, 7, 9, 36}) {
    for (const int empty : {-1, 0, 2, 3}) {
      std::vector<double> chains[kChainLanes];
      const double* rows[kChainLanes];
      for (int c = 0; c < kChainLanes; ++c) {
        for (int k = 0; k <= count; ++k) chains[c].push_back(number(c, k));
        rows[c] = c == empty ? nullptr : chains[c].data();
      }
      LaneBuffer lanes(static_cast<std::size_t>(count) + 1);
      lanes.fill(-1);
      gather_rows(rows, count, lanes.data());
      for (int k = 0; k <= count; ++k) {
        for (int c = 0; c < kChainLanes; ++c) {
          const double expected = k == count ? -1 : c == empty ? 0 : number(c, k);
          EXPECT_EQ(lanes.data()[k][c], expected) << count << " " << k << " " << c;
        }
      }
      std::vector<double> back[kChainLanes];
      double* targets[kChainLanes];
      for (int c = 0; c < kChainLanes; ++c) {
        back[c].assign(static_cast<std::size_t>(count) + 1, -2);
        targets[c] = c == empty ? nullptr : back[c].data();
      }
      scatter_rows(lanes.data(), count, targets);
      for (int c = 0; c < kChainLanes; ++c) {
        for (int k = 0; k <= count; ++k)
          EXPECT_EQ(back[c][static_cast<std::size_t>(k)],
                    k == count || c == empty ? -2 : number(c, k));
      }
    }
  }
}

TEST(LaneTranspose, LoadsFromAnyNumberOn) {
  std::vector<double> chains[kChainLanes];
  const double* rows[kChainLanes];
  for (int c = 0; c < kChainLanes; ++c) {
    for (int k = 0; k < 9; ++k) chains[c].push_back(number(c, k));
    rows[c] = chains[c].data();
  }
  Lanes block[kChainLanes];
  load_across(rows, 5, block);
  for (int k = 0; k < kChainLanes; ++k) {
    for (int c = 0; c < kChainLanes; ++c) EXPECT_EQ(block[k][c], number(c, 5 + k));
  }
}

}  // namespace
}  // namespace limber::rods::detail
