#include "engine/base/numerics/raise_shift.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

namespace limber {
namespace {

TEST(RaiseShift, EndsAboveTheLowestEigenvalue) {
  Eigen::Matrix2d matrix;
  matrix << 1, 3, 3, 1;  // eigenvalues -2 and 4
  int trials = 0;
  const auto shift = raise_shift({0.01, 10}, [&](double s) {
    ++trials;
    const Eigen::Matrix2d shifted = matrix + s * Eigen::Matrix2d::Identity();
    return Eigen::LLT<Eigen::Matrix2d>(shifted).info() == Eigen::Success;
  });
  ASSERT_TRUE(shift);
  EXPECT_DOUBLE_EQ(*shift, 10);
  EXPECT_EQ(trials, 4);
}

TEST(RaiseShift, TakesTheFirstThatServes) {
  const auto shift = raise_shift({0.5, 2}, [](double) { return true; });
  ASSERT_TRUE(shift);
  EXPECT_EQ(*shift, 0.5);
}

TEST(RaiseShift, EndsAfterTheLastTrial) {
  double last = 0;
  int trials = 0;
  EXPECT_FALSE(raise_shift({1, 2, 5}, [&](double s) {
    last = s;
    ++trials;
    return false;
  }));
  EXPECT_EQ(trials, 5);
  EXPECT_EQ(last, 16);
}

TEST(RaiseShift, EndsWhereShiftsAreNoLongerFinite) {
  for (const double first :
       {1e300, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(raise_shift({first, 10}, [](double s) {
      EXPECT_TRUE(std::isfinite(s));
      return false;
    }));
}

}  // namespace
}  // namespace limber
