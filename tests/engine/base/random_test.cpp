#include "engine/base/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace limber {
namespace {

// xoshiro256++ seeded by SplitMix64(0), computed independently in Python.
TEST(Random, KnownBits) {
  Random random(0);
  EXPECT_EQ(random.bits(), 0x53175d61490b23dfu);
  EXPECT_EQ(random.bits(), 0x61da6f3dc380d507u);
  EXPECT_EQ(random.bits(), 0x5c0fdf91ec9a7bfcu);
}

TEST(Random, UniformMomentsAndRange) {
  Random random(1);
  double sum = 0, squares = 0;
  constexpr int kCount = 200000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.uniform();
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    sum += x;
    squares += x * x;
  }
  EXPECT_NEAR(sum / kCount, 0.5, 0.003);
  EXPECT_NEAR(squares / kCount, 1.0 / 3, 0.003);
}

TEST(Random, NormalMoments) {
  Random random(2);
  constexpr int kCount = 400000;
  double moments[5] = {};
  int beyond_two = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal();
    ASSERT_TRUE(std::isfinite(x));
    double power = 1;
    for (double& moment : moments) {
      moment += power / kCount;
      power *= x;
    }
    if (std::abs(x) > 2) ++beyond_two;
  }
  EXPECT_NEAR(moments[1], 0, 0.008);
  EXPECT_NEAR(moments[2], 1, 0.01);
  EXPECT_NEAR(moments[3], 0, 0.03);
  EXPECT_NEAR(moments[4], 3, 0.08);
  EXPECT_NEAR(beyond_two / double{kCount}, std::erfc(2 / std::sqrt(2.0)), 0.0015);
}

TEST(Random, IndexIsUniform) {
  Random random(3);
  std::vector<int> counts(7, 0);
  for (int i = 0; i < 70000; ++i) ++counts[random.index(7)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 400);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(random.index(1), 0u);
}

TEST(Random, SameSeedSameNumbers) {
  Random a(42), b(42), c(43);
  bool differs = false;
  for (int i = 0; i < 1000; ++i) {
    const double x = a.normal();
    ASSERT_EQ(x, b.normal());
    differs = differs || x != c.normal();
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace limber
