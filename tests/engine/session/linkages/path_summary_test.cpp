// Messages on paths that reached no equilibrium.

#include "engine/session/linkages/path_summary.h"

#include <gtest/gtest.h>

#include "engine/base/degrees.h"

namespace limber::session {
namespace {

TEST(PathSummary, RequestsHaveTheirNameAndUnit) {
  scene::LinkageConditions before, wanted;
  before.loads = {{2, {0, 0, 0}, {0, 0, 0}, 7}};
  wanted = before;
  EXPECT_EQ(describe_request(before, wanted, 1), "");
  wanted.loads.push_back({5, {0, 3, -4}, {0, 0, 0}, 50});
  EXPECT_EQ(describe_request(before, wanted, 1),
            "; requested: a force of 5 N, a torque of 50 N m at joint 5");
  wanted.mean_angle = 60 * kDegree;
  wanted.angles = {{1, -20 * kDegree}};
  EXPECT_EQ(describe_request(before, wanted, 1),
            "; requested: a mean angle of 60 degrees; an angle of -20 degrees at joint 1; a force "
            "of 5 N, a torque of 50 N m at joint 5");
  wanted.gravity = {0, 0, -9.81};
  EXPECT_NE(describe_request(before, wanted, 1).find(", and 1 more"), std::string::npos);
}

TEST(PathSummary, PlacesAreInTheUnitOfTheScene) {
  scene::LinkageConditions before, wanted;
  scene::LinkageTarget target;
  target.id = 1;
  target.segment = 4;
  target.position = {0, 0, 1200};
  target.stiffness = 500;
  wanted.targets = {target};
  wanted.pins = {{3, scene::Held::kMotion, Eigen::Vector3d(100, 0, 0)}, {6, scene::Held::kMotion}};
  EXPECT_EQ(describe_request(before, wanted, 0.001),
            "; requested: segment 4 at (0, 0, 1200) mm by 500 N/m; joint 3 at (100, 0, 0) mm");
  before = wanted;
  wanted.targets[0].position.z() = 1300;
  EXPECT_EQ(describe_request(before, wanted, 0.5),
            "; requested: segment 4 at (0, 0, 1300) units of 0.5 m by 500 N/m");
}

TEST(PathSummary, ResistanceIsInNewtonsAndNewtonMetres) {
  EXPECT_EQ(describe_resistance({}, 1), "");
  rods::Resistance resistance;
  resistance.pin = {4, {0, 0, -12}, {0, 0, 0}, 0};
  resistance.angle = {7, {0, 0, 0}, {0, 0, 0}, 2500};  // [N mm]
  EXPECT_EQ(describe_resistance(resistance, 0.001),
            "; the most loaded pin is at joint 4, with a force of 12 N; the set angle that "
            "resists most is at joint 7, with a torque of 2.5 N m");
}

}  // namespace
}  // namespace limber::session
