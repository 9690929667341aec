#include "engine/rods/linkage/pairing_sweep.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>
#include <vector>

namespace limber::rods::detail {
namespace {

constexpr double kAnyCost = std::numeric_limits<double>::infinity();

/// Where rod ends meet: the only pairing is one segment for each rod.
JointChoices corner(int a, int b) { return {{a, b}, {{{{{0}, {1}}}, -1}}}; }

/// Four segments, clockwise. Straight through is best; the two others cost 1 and 3.
JointChoices crossing(int a, int b, int c, int d) {
  return {{a, b, c, d},
          {{{{{0, 2}, {1, 3}}}, -2}, {{{{0, 1}, {2, 3}}}, -1}, {{{{0, 3}, {1, 2}}}, 1}}};
}

SegmentLetters unknown_letters(int segments) {
  return SegmentLetters(static_cast<std::size_t>(segments), -1);
}

TEST(PairingSweep, ALoneCrossingGoesStraightThrough) {
  const std::vector<JointChoices> joints = {crossing(0, 1, 2, 3)};
  const PairingSweep sweep(joints, {0}, unknown_letters(4));
  const auto result = sweep.run(100, kAnyCost);
  EXPECT_TRUE(result.found);
  EXPECT_TRUE(result.is_least);
  EXPECT_EQ(result.cost, 0);
  EXPECT_EQ(result.pairings, (std::vector<int>{0}));
}

TEST(PairingSweep, OnlyWhatIsCheaperIsFound) {
  const std::vector<JointChoices> joints = {crossing(0, 1, 2, 3)};
  const SegmentLetters letters = {0, 0, 1, 1};  // straight through is not possible
  const PairingSweep sweep(joints, {0}, letters);
  EXPECT_TRUE(sweep.run(100, 1.01).found);
  const auto dearer = sweep.run(100, 1);
  EXPECT_FALSE(dearer.found);
  EXPECT_TRUE(dearer.is_least);  // nothing was left out: there is none
}

TEST(PairingSweep, KnownLettersForceABend) {
  const std::vector<JointChoices> joints = {crossing(0, 1, 2, 3)};
  const auto pairing_for = [&](const SegmentLetters& letters) {
    const auto result = PairingSweep(joints, {0}, letters).run(100, kAnyCost);
    return result.found ? std::pair(result.pairings[0], result.cost) : std::pair(-1, 0.0);
  };
  EXPECT_EQ(pairing_for({0, -1, 0, -1}), std::pair(0, 0.0));
  EXPECT_EQ(pairing_for({1, 1, 0, -1}), std::pair(1, 1.0));
  EXPECT_EQ(pairing_for({0, 1, 1, -1}), std::pair(2, 3.0));
  EXPECT_EQ(pairing_for({0, 0, 0, -1}), std::pair(-1, 0.0));
}

/// Rods around a loop of corners are of the two families by turns.
TEST(PairingSweep, LoopsOfCornersNeedAnEvenNumber) {
  for (int count = 3; count <= 9; ++count) {
    std::vector<JointChoices> joints;
    std::vector<int> members;
    for (int i = 0; i < count; ++i) {
      joints.push_back(corner(i, (i + 1) % count));
      members.push_back(i);
    }
    const auto result = PairingSweep(joints, members, unknown_letters(count)).run(100, kAnyCost);
    EXPECT_EQ(result.found, count % 2 == 0) << count;
    EXPECT_TRUE(result.is_least);
  }
}

/// Two corners connect two segments of a crossing by a third one: both are of the other family
/// than that, hence of one rod of the crossing.
TEST(PairingSweep, ATriangleBendsTheCrossingAtItsApex) {
  const std::vector<JointChoices> joints = {crossing(0, 1, 2, 3), corner(0, 4), corner(4, 2)};
  const auto straight = PairingSweep(joints, {0, 1, 2}, unknown_letters(5)).run(100, kAnyCost);
  EXPECT_TRUE(straight.found);
  EXPECT_EQ(straight.cost, 0);  // 0 and 2 are opposite
  const std::vector<JointChoices> bent = {crossing(0, 1, 2, 3), corner(0, 4), corner(4, 1)};
  const auto result = PairingSweep(bent, {0, 1, 2}, unknown_letters(5)).run(100, kAnyCost);
  EXPECT_TRUE(result.found);
  EXPECT_TRUE(result.is_least);
  EXPECT_EQ(result.cost, 1);
  EXPECT_EQ(result.pairings, (std::vector<int>{1, 0, 0}));
}

TEST(PairingSweep, PairingsAreInTheOrderOfTheMembers) {
  const std::vector<JointChoices> joints = {crossing(0, 1, 2, 3), crossing(4, 5, 6, 7),
                                            crossing(8, 9, 10, 11)};
  SegmentLetters letters = unknown_letters(12);
  letters[4] = letters[5] = 0;   // joint 1 takes its second
  letters[8] = letters[11] = 1;  // joint 2 its third
  const auto result = PairingSweep(joints, {2, 0, 1}, letters).run(100, kAnyCost);
  EXPECT_TRUE(result.found);
  EXPECT_EQ(result.pairings, (std::vector<int>{2, 0, 1}));
  EXPECT_EQ(result.cost, 4);
}

/// What is left out is owned up to.
TEST(PairingSweep, ANarrowFrontierDoesNotClaimToBeLeast) {
  // A ladder of two crossings that share two segments and then disagree at a corner.
  const std::vector<JointChoices> joints = {crossing(0, 1, 2, 3), crossing(2, 4, 5, 3),
                                            corner(0, 6),         corner(6, 1),
                                            corner(5, 7),         corner(7, 4)};
  const PairingSweep sweep(joints, {0, 1, 2, 3, 4, 5}, unknown_letters(8));
  const auto wide = sweep.run(1000, kAnyCost);
  ASSERT_TRUE(wide.found);
  EXPECT_TRUE(wide.is_least);
  for (std::size_t width = 1; width < 6; ++width) {
    const auto narrow = sweep.run(width, kAnyCost);
    if (narrow.found) {
      EXPECT_GE(narrow.cost, wide.cost);
    }
    if (narrow.is_least) {
      EXPECT_TRUE(narrow.found);
      EXPECT_EQ(narrow.cost, wide.cost);
    }
  }
}

TEST(PairingSweep, WithoutMembersNothingIsToBeChosen) {
  const std::vector<JointChoices> joints = {corner(0, 1)};
  const auto result = PairingSweep(joints, {}, unknown_letters(2)).run(1, kAnyCost);
  EXPECT_TRUE(result.found);
  EXPECT_TRUE(result.pairings.empty());
}

}  // namespace
}  // namespace limber::rods::detail
