// What a linkage's conditions may be: every fault alone, with its field.

#include <gtest/gtest.h>

#include <functional>

#include "engine/scene/linkage.h"
#include "tests/engine/scene/not_finite.h"

namespace limber::scene {
namespace {

using testing::kNan;

LinkageConditions good() {
  LinkageConditions conditions;
  conditions.pins = {{0, Held::kMotion}, {3, Held::kMotionAndAngle}};
  conditions.angles = {{1, 0.5}};
  conditions.mean_angle = 1;
  LinkageTarget at_joint;
  at_joint.id = 1;
  at_joint.joint = 2;
  at_joint.stiffness = 10;
  LinkageTarget on_segment = at_joint;
  on_segment.id = 2;
  on_segment.joint = -1;
  on_segment.segment = 5;
  conditions.targets = {at_joint, on_segment};
  conditions.loads = {{4, {0, 0, -1}, {0, 0, 0}, 0.1}};
  return conditions;
}

TEST(LinkageConditions, GoodOnesPass) {
  EXPECT_TRUE(validate(good(), 6, 7).empty());
  EXPECT_TRUE(validate({}, 0, 1).empty());
}

TEST(LinkageConditions, EachFaultIsNamedAloneWithItsField) {
  struct Fault {
    const char* field;
    std::function<void(LinkageConditions&)> make;
    ErrorCode code = ErrorCode::kInvalidArgument;
  };
  const Fault faults[] = {
      {"pins[1].joint", [](auto& c) { c.pins[1].joint = 6; }, ErrorCode::kOutOfRange},
      {"pins[1].joint", [](auto& c) { c.pins[1].joint = 0; }},
      {"pins[0].position", [](auto& c) { c.pins[0].position = Eigen::Vector3d(kNan, 0, 0); }},
      {"pins[1].position",
       [](auto& c) {
         c.pins[1] = {3, Held::kAngle, Eigen::Vector3d(0, 0, 0)};
       }},
      {"angles[0].joint", [](auto& c) { c.angles[0].joint = -1; }, ErrorCode::kOutOfRange},
      {"angles[0].joint", [](auto& c) { c.angles[0].joint = 3; }},
      {"angles[1].joint",
       [](auto& c) {
         c.angles.push_back({1, 0.4});
       }},
      {"angles[0].angle", [](auto& c) { c.angles[0].angle = 3.2; }, ErrorCode::kOutOfRange},
      {"angles[0].angle", [](auto& c) { c.angles[0].angle = kNan; }, ErrorCode::kOutOfRange},
      {"mean_angle", [](auto& c) { c.mean_angle = -4; }, ErrorCode::kOutOfRange},
      {"targets[1].id", [](auto& c) { c.targets[1].id = 1; }, ErrorCode::kAlreadyExists},
      {"targets[0]", [](auto& c) { c.targets[0].segment = 1; }},
      {"targets[0].joint", [](auto& c) { c.targets[0].joint = 6; }, ErrorCode::kOutOfRange},
      {"targets[1].segment", [](auto& c) { c.targets[1].segment = 7; }, ErrorCode::kOutOfRange},
      {"targets[1].share", [](auto& c) { c.targets[1].share = 1.5; }},
      {"targets[1].position", [](auto& c) { c.targets[1].position.x() = kNan; }},
      {"targets[0].stiffness", [](auto& c) { c.targets[0].stiffness = 0; }},
      {"loads[0].joint", [](auto& c) { c.loads[0].joint = 9; }, ErrorCode::kOutOfRange},
      {"loads[1].joint", [](auto& c) { c.loads.push_back(c.loads[0]); }},
      {"loads[0].force", [](auto& c) { c.loads[0].force.y() = kNan; }},
      {"loads[0].moment", [](auto& c) { c.loads[0].moment.y() = kNan; }},
      {"loads[0].torque", [](auto& c) { c.loads[0].torque = kNan; }},
      {"gravity", [](auto& c) { c.gravity.z() = kNan; }},
  };
  for (const Fault& fault : faults) {
    LinkageConditions conditions = good();
    fault.make(conditions);
    const auto issues = validate(conditions, 6, 7);
    ASSERT_EQ(issues.size(), 1u) << fault.field;
    EXPECT_EQ(issues[0].field, fault.field);
    EXPECT_EQ(issues[0].code, fault.code) << fault.field;
    EXPECT_FALSE(issues[0].message.empty());
  }
}

TEST(LinkageConditions, AMeanAngleNeedsAJointThatIsFree) {
  LinkageConditions conditions;
  conditions.pins = {{0, Held::kAngle}};
  conditions.angles = {{1, 0.5}};
  conditions.mean_angle = 0.7;
  EXPECT_TRUE(validate(conditions, 3, 3).empty());
  const auto issues = validate(conditions, 2, 3);
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].field, "mean_angle");
}

TEST(LinkageConditions, AMeanAngleThatWindsUpTheOtherJointsIsRefused) {
  LinkageConditions conditions;
  conditions.angles = {{0, 0.3}, {1, 0.3}};
  conditions.mean_angle = 1.2;
  EXPECT_TRUE(validate(conditions, 3, 3).empty());  // leaves 3 to the third
  conditions.mean_angle = 1.3;
  const auto issues = validate(conditions, 3, 3);
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].field, "mean_angle");
  EXPECT_NE(issues[0].message.find("189.1 degrees"), std::string::npos) << issues[0].message;
}

}  // namespace
}  // namespace limber::scene
