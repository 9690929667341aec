#include "engine/base/numerics/median.h"

#include <gtest/gtest.h>

#include <limits>

namespace limber {
namespace {

TEST(Median, IsTheUpperOfTwoInTheMiddle) {
  EXPECT_EQ(median({7}), 7);
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 3, 2}), 3);
  EXPECT_EQ(median({2, 1}), 2);
}

TEST(Median, EqualAndInfiniteValuesAreNoSpecialCase) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(median({5, 5, 1, 5, 9}), 5);
  EXPECT_EQ(median({kInfinite, -kInfinite, 0.5}), 0.5);
  EXPECT_EQ(median({kInfinite, 1, kInfinite}), kInfinite);
}

}  // namespace
}  // namespace limber
