#include "engine/scene/constraint_path.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"

namespace limber::scene {
namespace {

Constraint path(std::vector<PathKey> keys) {
  Constraint made;
  made.frame = 10;
  made.target = {0, 1, -2};
  made.path = std::move(keys);
  return made;
}

TEST(ConstraintPath, AHoldStaysWhereItIs) {
  const Constraint hold = path({{37, {0, 1, -2}}});
  EXPECT_EQ(hold.last_frame(), 37);
  for (int frame = 10; frame <= 37; ++frame)
    EXPECT_EQ(target_in(hold, frame), Eigen::Vector3d(0, 1, -2));
}

TEST(ConstraintPath, IsExactAtItsKeysAndDoesNotOvershoot) {
  const Constraint one =
      path({{14, {1, 1, -2}}, {40, {1, 1, -2}}, {41, {1, 0, -5}}, {60, {3, 2, -7}}});
  EXPECT_EQ(target_in(one, 10), one.target);
  for (const PathKey& key : one.path) EXPECT_EQ(target_in(one, key.frame), key.target);
  for (int frame = 11; frame <= 60; ++frame) {
    const Eigen::Vector3d by = target_in(one, frame) - target_in(one, frame - 1);
    EXPECT_GE(by.x(), -1e-12) << frame;
    EXPECT_LE(by.z(), 1e-12) << frame;
  }
  for (int frame = 14; frame <= 40; ++frame) EXPECT_EQ(target_in(one, frame), one.path[0].target);
}

TEST(ConstraintPath, EaseSaysHowFarItBeginsAndEndsAtRest) {
  Constraint one = path({{20, {1, 1, -2}}});
  EXPECT_NEAR(target_in(one, 12).x(), 3 * 0.04 - 2 * 0.008, 1e-15);
  EXPECT_NEAR(target_in(one, 15).x(), 0.5, 1e-15);
  one.ease_in = one.ease_out = 0;
  for (int frame = 10; frame <= 20; ++frame)
    EXPECT_NEAR(target_in(one, frame).x(), (frame - 10) / 10.0, 1e-15);
  one.ease_in = 1;  // from rest to the speed of the piece
  EXPECT_LT(target_in(one, 11).x(), 0.03);
  EXPECT_NEAR(target_in(one, 20).x() - target_in(one, 19).x(), 0.1, 0.02);
}

/// Speeds are continuous at inner keys: halved steps halve the differences of speeds.
TEST(ConstraintPath, PassesThroughInnerKeysWithoutAJump) {
  const Constraint coarse = path({{30, {2, 1, -2}}, {70, {5, 1, -2}}});
  const double before = target_in(coarse, 30).x() - target_in(coarse, 29).x();
  const double after = target_in(coarse, 31).x() - target_in(coarse, 30).x();
  EXPECT_NEAR(before, after, 0.01);
  EXPECT_GT(before, 0.05);
}

TEST(ConstraintPath, MovesAsAWhole) {
  Constraint one = path({{20, {1, 1, -2}}, {30, {4, 1, -2}}});
  const Constraint before = one;
  move_path(one, {5, 5, 5});
  for (int frame = 10; frame <= 30; ++frame) {
    const Eigen::Vector3d by = target_in(one, frame) - target_in(before, frame);
    EXPECT_LT((by - Eigen::Vector3d(5, 4, 7)).norm(), 1e-12);
  }
}

TEST(ConstraintPath, RefusesWhatIsNone) {
  const auto field_of = [](Constraint constraint, int frames = 100) -> std::string {
    try {
      check_path(constraint, frames);
    } catch (const Error& error) {
      return error.field();
    }
    return {};
  };
  EXPECT_EQ(field_of(path({{20, {0, 0, 0}}, {21, {0, 0, 0}}})), "");
  EXPECT_EQ(field_of(path({{10, {0, 0, 0}}})), "path[0].frame");
  EXPECT_EQ(field_of(path({{20, {0, 0, 0}}, {20, {0, 0, 0}}})), "path[1].frame");
  EXPECT_EQ(field_of(path({{100, {0, 0, 0}}})), "path[0].frame");
  EXPECT_EQ(field_of(path({{20, {0, std::nan(""), 0}}})), "path[0].target");
  EXPECT_EQ(field_of(path({{10 + kMaxPathFrames, {0, 0, 0}}}), 5000), "path");
  Constraint one = path({{20, {0, 0, 0}}});
  one.ease_in = 1.5;
  EXPECT_EQ(field_of(one), "ease_in");
  one.ease_in = 1;
  one.ease_out = std::nan("");
  EXPECT_EQ(field_of(one), "ease_out");
  one.ease_out = 0;
  one.kind = TargetKind::kVelocity;
  EXPECT_EQ(field_of(one), "path");
}

}  // namespace
}  // namespace limber::scene
