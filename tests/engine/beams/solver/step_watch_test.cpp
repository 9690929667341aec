#include "engine/beams/solver/step_watch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/beam_problems.h"

namespace limber::beams::detail {
namespace {

using Judgement = StepWatch::Judgement;

constexpr double kLargest = 0.3;
constexpr double kShortest = 1e-4;
constexpr int kTip = 4;

/// Four elements of a quarter, of which the last node turns about y and nothing else moves.
struct StepWatchOfATip : ::testing::Test {
  BeamStructure structure{[] {
    BeamModel model = limber::testing::straight_beam(kTip);
    model.supports = {limber::testing::clamped(0)};
    return model;
  }()};
  StepWatch watch{structure, kLargest, kShortest};

  [[nodiscard]] BeamState turned(double angle) const {
    BeamState state = structure.rest_state();
    state.rotations[kTip] = rotation_by({0, angle, 0});
    return state;
  }
  Judgement judge(double from, double to, double s, double next) {
    return watch.judge(turned(from), turned(to), s, next);
  }
};

TEST_F(StepWatchOfATip, AFirstStepSwervesByHalfOfWhatItTurns) {
  EXPECT_EQ(judge(0, 0.4, 0, 0.1), Judgement::kContinues);
  EXPECT_NEAR(watch.verdict().turn, 0.4, 1e-12);
  EXPECT_NEAR(watch.verdict().swerve, 0.2, 1e-12);
  EXPECT_NEAR(watch.factor(), std::sqrt(0.5 * kLargest / 0.2), 1e-12);
  StepWatch another(structure, kLargest, kShortest);
  EXPECT_EQ(another.judge(turned(0), turned(0.7), 0, 0.1), Judgement::kTooFar);
}

TEST_F(StepWatchOfATip, StraightOnIsNoSwerveHoweverFar) {
  ASSERT_EQ(judge(0, 0.1, 0, 0.01), Judgement::kContinues);
  EXPECT_EQ(judge(0.1, 1.1, 0.01, 0.11), Judgement::kContinues);  // ten times as long
  EXPECT_NEAR(watch.verdict().swerve, 0, 1e-12);
  EXPECT_NEAR(watch.verdict().turn, 1, 1e-12);
  EXPECT_EQ(watch.factor(), 2);
  EXPECT_EQ(judge(1.1, 1.2, 0.11, 0.12), Judgement::kContinues);
  EXPECT_NEAR(watch.verdict().swerve, 0, 1e-12);
}

TEST_F(StepWatchOfATip, WhatBendsTooMuchIsDoneOnceMore) {
  ASSERT_EQ(judge(0, 0.1, 0, 0.1), Judgement::kContinues);
  EXPECT_EQ(judge(0.1, 0.8, 0.1, 0.2), Judgement::kTooFar);
  EXPECT_NEAR(watch.verdict().swerve, 0.6, 1e-12);
  EXPECT_EQ(watch.verdict().node, kTip);
  EXPECT_NEAR(watch.factor(), 0.5, 1e-12);
  // Half of it is fine, but is not followed by longer steps towards where it went too far.
  EXPECT_EQ(judge(0.1, 0.16, 0.1, 0.15), Judgement::kContinues);
  EXPECT_NEAR(watch.factor(), 1, 1e-9);
  EXPECT_EQ(judge(0.16, 0.28, 0.15, 0.25), Judgement::kContinues);
  EXPECT_EQ(watch.factor(), 2);
}

TEST_F(StepWatchOfATip, ShortStepsGrowWhereALongOneWentTooFar) {
  ASSERT_EQ(judge(0, 0.001, 0, 0.001), Judgement::kContinues);
  EXPECT_EQ(judge(0.001, 2, 0.001, 0.9), Judgement::kTooFar);
  EXPECT_EQ(judge(0.001, 0.002, 0.001, 0.002), Judgement::kContinues);
  EXPECT_EQ(watch.factor(), 2);
  // By what is left at most.
  EXPECT_EQ(judge(0.002, 0.502, 0.002, 0.502), Judgement::kContinues);
  EXPECT_EQ(watch.factor(), 1);
}

TEST_F(StepWatchOfATip, WhatStaysHoweverShortTheStepIsAJump) {
  ASSERT_EQ(judge(0, 0.001, 0, 0.001), Judgement::kContinues);
  EXPECT_EQ(judge(0.001, 1, 0.001, 0.004), Judgement::kTooFar);
  EXPECT_EQ(judge(0.001, 1, 0.001, 0.002), Judgement::kTooFar);
  EXPECT_EQ(watch.factor(), 0.25);
  EXPECT_EQ(judge(0.001, 1, 0.001, 0.00125), Judgement::kJump);
  EXPECT_EQ(watch.factor(), 2);
  // The next one is a first one.
  EXPECT_EQ(judge(1, 1.2, 0.00125, 0.003), Judgement::kContinues);
  EXPECT_NEAR(watch.verdict().swerve, 0.1, 1e-12);
}

TEST_F(StepWatchOfATip, WhatGetsSmallerWithTheStepIsNoJump) {
  ASSERT_EQ(judge(0, 0.001, 0, 0.001), Judgement::kContinues);
  double turn = 2, step = 0.003;
  while (turn > 0.35) {  // of a fold: with the root of the step
    EXPECT_EQ(judge(0.001, turn, 0.001, 0.001 + step), Judgement::kTooFar) << turn;
    turn *= 0.7;
    step *= 0.5;
  }
}

TEST_F(StepWatchOfATip, LongStepsAreNoJumpsAndTheShortestAre) {
  ASSERT_EQ(judge(0, 0.001, 0, 0.1), Judgement::kContinues);
  for (const double next : {0.5, 0.4, 0.3, 0.2})
    EXPECT_EQ(judge(0.001, 1, 0.1, next), Judgement::kTooFar);
  EXPECT_EQ(judge(0.001, 1, 0.1, 0.1 + kShortest / 2), Judgement::kJump);
}

TEST_F(StepWatchOfATip, GoingBackByMoreThanItCameIsTooFarHoweverSmall) {
  ASSERT_EQ(judge(0, 0.01, 0, 0.1), Judgement::kContinues);
  EXPECT_EQ(judge(0.01, -0.02, 0.1, 0.2), Judgement::kTooFar);
  EXPECT_EQ(watch.factor(), 0.25);
  EXPECT_EQ(judge(0.01, 0.005, 0.1, 0.2), Judgement::kContinues);  // by less: a fold does that
}

TEST_F(StepWatchOfATip, SurprisesAreHalfOfWhatIsExpected) {
  EXPECT_TRUE(watch.surprises(turned(0), turned(0.001), 0.1));  // nothing is expected
  ASSERT_EQ(judge(0, 0.2, 0, 0.1), Judgement::kContinues);
  EXPECT_FALSE(watch.surprises(turned(0.2), turned(0.49), 0.1));
  EXPECT_TRUE(watch.surprises(turned(0.2), turned(0.51), 0.1));
  EXPECT_TRUE(watch.surprises(turned(0.2), turned(0.49), 0.05));
  watch.forget();
  EXPECT_TRUE(watch.surprises(turned(0.2), turned(0.4), 0.1));
}

TEST_F(StepWatchOfATip, ChordsTurnToo) {
  BeamState state = structure.rest_state();
  state.positions(2, 2) += 0.05;  // chords on both sides of it are a quarter long
  EXPECT_NEAR(turn_between(structure, structure.rest_state(), state).angle, 0.2, 1e-12);
  state.positions.row(2).array() += 7;  // all together: no chord turns
  BeamState moved = structure.rest_state();
  moved.positions.row(2).array() += 7;
  EXPECT_NEAR(turn_between(structure, moved, state).angle, 0.2, 1e-12);
}

TEST_F(StepWatchOfATip, QuaternionsOfBothSignsAreOneRotation) {
  BeamState state = turned(0.4);
  state.rotations[kTip].coeffs() *= -1;
  EXPECT_NEAR(turn_between(structure, turned(0.1), state).angle, 0.3, 1e-12);
}

}  // namespace
}  // namespace limber::beams::detail
