#include "engine/base/start_shift.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/base/error.h"

namespace limber {
namespace {

TEST(StartShift, SharesFromZeroToAMillionthAreRead) {
  EXPECT_EQ(parse_start_shift("0"), 0);
  EXPECT_EQ(parse_start_shift("1e-13"), 1e-13);
  EXPECT_EQ(parse_start_shift("1e-6"), 1e-6);
}

TEST(StartShift, OtherValuesAreErrors) {
  for (const char* text :
       {"", "x", "1e-13 ", " 1e-13", "-1e-13", "2e-6", "1", "nan", "inf", "1e-13x"}) {
    try {
      (void)parse_start_shift(text);
      ADD_FAILURE() << "'" << text << "' is taken";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      EXPECT_EQ(error.field(), "LIMBER_START_SHIFT");
      EXPECT_NE(std::string(error.what()).find(std::string("'") + text + "'"), std::string::npos);
    }
  }
}

TEST(StartShift, MovesAreOfTheShareAndComeAgain) {
  EXPECT_EQ(start_moves(100, 0).size(), 0);
  const Eigen::VectorXd moves = start_moves(100, 1e-13);
  ASSERT_EQ(moves.size(), 100);
  EXPECT_LE(moves.cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_GT(moves.maxCoeff(), 0.5e-13);
  EXPECT_LT(moves.minCoeff(), -0.5e-13);
  EXPECT_EQ(moves, start_moves(100, 1e-13));
}

/// The variable is read once in a process: each of these is one of its own.
struct StartShiftDeathTest : ::testing::Test {
  StartShiftDeathTest() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
  static int shifted_with(const char* text) {
    if (text == nullptr) {
      ::unsetenv("LIMBER_START_SHIFT");
    } else {
      ::setenv("LIMBER_START_SHIFT", text, 1);
    }
    try {
      const Eigen::VectorXd moves = start_moves(3);
      return moves.size() == 3 && !moves.isZero(0) && moves.cwiseAbs().maxCoeff() <= start_shift()
                 ? 1
                 : 0;
    } catch (const Error&) {
      return 2;
    }
  }
};

TEST_F(StartShiftDeathTest, TheVariableMovesStarts) {
  EXPECT_EXIT(std::exit(shifted_with("1e-13")), ::testing::ExitedWithCode(1), "");
  EXPECT_EXIT(std::exit(shifted_with(nullptr)), ::testing::ExitedWithCode(0), "");
  EXPECT_EXIT(std::exit(shifted_with("1e-13.")), ::testing::ExitedWithCode(2), "");
}

}  // namespace
}  // namespace limber
