#include "engine/base/disjoint_sets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/base/random.h"

namespace limber {
namespace {

TEST(DisjointSets, EachItemBeginsAlone) {
  DisjointSets sets(3);
  for (int item = 0; item < 3; ++item) EXPECT_EQ(sets.lowest(item), item);
}

TEST(DisjointSets, AChainIsOneSetInWhateverOrderItIsJoined) {
  constexpr int kCount = 1000;
  DisjointSets ascending(kCount), descending(kCount);
  for (int i = 0; i + 1 < kCount; ++i) ascending.join(i, i + 1);
  for (int i = kCount - 2; i >= 0; --i) descending.join(i + 1, i);
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(ascending.lowest(i), 0);
    EXPECT_EQ(descending.lowest(i), 0);
  }
}

TEST(DisjointSets, JoiningTwiceOrAnItemWithItselfChangesNothing) {
  DisjointSets sets(4);
  sets.join(3, 1);
  sets.join(1, 3);
  sets.join(2, 2);
  EXPECT_EQ(sets.lowest(3), 1);
  EXPECT_EQ(sets.lowest(2), 2);
  EXPECT_EQ(sets.lowest(0), 0);
}

TEST(DisjointSets, AgreeWithSetsPaintedOneByOne) {
  constexpr int kCount = 60;
  Random random(5);
  DisjointSets sets(kCount);
  std::vector<int> paint(kCount);
  for (int i = 0; i < kCount; ++i) paint[static_cast<std::size_t>(i)] = i;
  for (int join = 0; join < 45; ++join) {
    const auto a = static_cast<int>(kCount * random.uniform());
    const auto b = static_cast<int>(kCount * random.uniform());
    sets.join(a, b);
    const int one = paint[static_cast<std::size_t>(a)], other = paint[static_cast<std::size_t>(b)];
    std::replace(paint.begin(), paint.end(), std::max(one, other), std::min(one, other));
    for (int i = 0; i < kCount; ++i) EXPECT_EQ(sets.lowest(i), paint[static_cast<std::size_t>(i)]);
  }
}

}  // namespace
}  // namespace limber
