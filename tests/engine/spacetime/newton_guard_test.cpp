#include "engine/spacetime/newton_guard.h"

#include <gtest/gtest.h>

namespace limber::spacetime {
namespace {

NewtonGuard fresh() {
  NewtonGuard guard;
  guard.set_curvature(2.0);
  return guard;
}

TEST(NewtonGuard, TrustsTheFullModelAtFirst) {
  const NewtonGuard guard = fresh();
  EXPECT_EQ(guard.part(), 1);
  EXPECT_EQ(guard.shift(), 0);
  EXPECT_TRUE(guard.may_retry());
}

TEST(NewtonGuard, ShiftsUntilTheSystemIsDefiniteAndGivesUpBeyondTheCurvature) {
  NewtonGuard guard = fresh();
  double last = 0;
  int times = 0;
  while (guard.strengthen()) {
    EXPECT_GT(guard.shift(), last);
    last = guard.shift();
    ASSERT_LT(++times, 40);
  }
  EXPECT_GT(last, 2 * 2.0);
}

TEST(NewtonGuard, DropsTheShiftWhereStepsAreGood) {
  NewtonGuard guard = fresh();
  guard.judge(0.1, 1);
  EXPECT_GT(guard.shift(), 0);
  for (int i = 0; i < 10; ++i) guard.judge(1, 1);
  EXPECT_EQ(guard.shift(), 0);
  EXPECT_EQ(guard.part(), 1);
}

TEST(NewtonGuard, ALongPathInShortStepsChangesToPartsOfTheCurvatureAndACutStepBack) {
  NewtonGuard guard = fresh();
  int steps = 0;
  do {
    guard.judge(0.5, 1);    // good enough to keep the shift
    guard.judge(0.2, 0.5);  // poor: a larger one
    ASSERT_LT(++steps, 100);
  } while (guard.shift() > 0);
  EXPECT_EQ(guard.part(), 1);
  EXPECT_TRUE(guard.strengthen());
  EXPECT_EQ(guard.shift(), 0);
  EXPECT_LT(guard.part(), 1);
  EXPECT_TRUE(guard.may_retry());  // the step that brought the change may have been refused
  guard.judge(0.5, 1);
  EXPECT_FALSE(guard.may_retry());
  guard.judge(0, 0);  // refused
  EXPECT_TRUE(guard.may_retry());
  EXPECT_TRUE(guard.strengthen());
  EXPECT_GT(guard.shift(), 0);
}

}  // namespace
}  // namespace limber::spacetime
