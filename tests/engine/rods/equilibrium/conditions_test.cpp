#include "engine/rods/equilibrium/conditions.h"

#include <gtest/gtest.h>

#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

struct Refused {
  const char* name;
  void (*spoil)(Conditions&);
  ErrorCode code;
  const char* field;
};

class BadConditions : public ::testing::TestWithParam<Refused> {};

TEST_P(BadConditions, AreRefusedByName) {
  const LinkageModel model = testing::grid_model(3, 3, 1.0);
  Conditions conditions;
  conditions.pins = {{4}};
  conditions.validate(model);
  GetParam().spoil(conditions);
  try {
    conditions.validate(model);
    FAIL() << GetParam().name;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), GetParam().code) << error.what();
    EXPECT_EQ(error.field(), GetParam().field) << error.what();
  }
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    All, BadConditions,
    ::testing::Values(
        Refused{"joint", [](Conditions& c) { c.pins.push_back({9}); }, ErrorCode::kOutOfRange,
                "pins[1].joint"},
        Refused{"pinned twice",
                [](Conditions& c) {
                  c.pins.push_back({4, Hold::kAngle});
                },
                ErrorCode::kInvalidArgument, "pins[1].joint"},
        Refused{"pinned and set",
                [](Conditions& c) {
                  c.pins[0].hold = Hold::kMotionAndAngle;
                  c.angles = {{2, 0.5}, {4, 0.5}};
                },
                ErrorCode::kInvalidArgument, "angles[1].joint"},
        Refused{"position of an angle",
                [](Conditions& c) {
                  c.pins.push_back({3, Hold::kAngle, Eigen::Vector3d::Zero()});
                },
                ErrorCode::kInvalidArgument, "pins[1].position"},
        Refused{"unreachable angle",
                [](Conditions& c) {
                  c.angles = {{1, 4}};
                },
                ErrorCode::kInvalidArgument, "angles[0].angle"},
        Refused{"unreachable angle of two segments",
                [](Conditions& c) {
                  c.angles = {{0, 6.3}};
                },
                ErrorCode::kInvalidArgument, "angles[0].angle"},
        Refused{"unreachable mean", [](Conditions& c) { c.mean_opening_angle = -4; },
                ErrorCode::kInvalidArgument, "mean_opening_angle"},
        Refused{"mean of prescribed angles",
                [](Conditions& c) {
                  for (int j = 0; j < 9; ++j) c.angles.push_back({j, 1.0});
                  c.mean_opening_angle = 1;
                },
                ErrorCode::kInvalidArgument, "mean_opening_angle"},
        Refused{"no such vertex",
                [](Conditions& c) {
                  c.springs = {{VertexPoint{0, 7}, Eigen::Vector3d::Zero(), 1}};
                },
                ErrorCode::kOutOfRange, "springs[0].at.vertex"},
        Refused{"share",
                [](Conditions& c) {
                  c.springs = {{ArcPoint{0, 1.5}, Eigen::Vector3d::Zero(), 1}};
                },
                ErrorCode::kInvalidArgument, "springs[0].at.share"},
        Refused{"stiffness",
                [](Conditions& c) {
                  c.springs = {{JointPoint{0}, Eigen::Vector3d::Zero(), 0}};
                },
                ErrorCode::kInvalidArgument, "springs[0].stiffness"},
        Refused{"load", [](Conditions& c) { c.loads = {{-1}}; }, ErrorCode::kOutOfRange,
                "loads[0].joint"},
        Refused{"moment",
                [](Conditions& c) {
                  c.loads = {{0, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, kNan, 0), 0}};
                },
                ErrorCode::kInvalidArgument, "loads[0].moment"},
        Refused{"mass", [](Conditions& c) { c.gravity.mass_per_length = -1; },
                ErrorCode::kInvalidArgument, "gravity.mass_per_length"},
        Refused{"shortest", [](Conditions& c) { c.shortest_joint_edge = 0; },
                ErrorCode::kInvalidArgument, "shortest_joint_edge"}));

}  // namespace
}  // namespace limber::rods
