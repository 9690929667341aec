#include "engine/session/linkages/place_reach.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "engine/base/error.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::session {
namespace {

/// Two rods that cross in one joint at the centre of a rectangle, 4 x 2, around (10, 0, 0).
rods::LinkageGraph cross_at_ten() {
  return rods::build_linkage_graph(
      rods::testing::mesh_of({{10, 0, 0}, {8, -1, 0}, {12, 1, 0}, {8, 1, 0}, {12, -1, 0}},
                             {{0, 1}, {0, 2}, {0, 3}, {0, 4}}));
}

TEST(PlaceReach, IsCountedFromTheMiddleInExtents) {
  const PlaceReach reach(cross_at_ten(), 1);
  EXPECT_FALSE(reach.is_far({10 + 3.999e6, 0, 0}));
  EXPECT_TRUE(reach.is_far({10 + 4.001e6, 0, 0}));
  EXPECT_FALSE(reach.is_far({10, 3.999e6, -3.999e6}));  // each axis for itself
  EXPECT_TRUE(reach.is_far({10, 0, -4.001e6}));
}

TEST(PlaceReach, IssuesNameWhatIsFarAndItsUnit) {
  const PlaceReach reach(cross_at_ten(), 0.001);
  scene::LinkageConditions conditions;
  conditions.targets = {{1, 0, -1, 0.5, {0, 0, 0}, 1},
                        {2, 0, -1, 0.5, {0, 5e6, 0}, 1},
                        {3, -1, 2, 0.25, {0, 5e6, 0}, 1}};
  conditions.pins = {{0, scene::Held::kAngle, std::nullopt},
                     {0, scene::Held::kMotion, Eigen::Vector3d(0, 0, 5e6)}};
  const auto issues = reach.check(conditions);
  ASSERT_EQ(issues.size(), 3u);
  EXPECT_EQ(issues[0].field, "targets[1].position");
  EXPECT_EQ(issues[0].code, ErrorCode::kOutOfRange);
  EXPECT_NE(issues[0].message.find("the target of joint 0 at (0, 5e+06, 0) mm"), std::string::npos)
      << issues[0].message;
  EXPECT_EQ(issues[1].field, "targets[2].position");
  EXPECT_NE(issues[1].message.find("segment 2 (share 0.25)"), std::string::npos);
  EXPECT_EQ(issues[2].field, "pins[1].position");
}

}  // namespace
}  // namespace limber::session
