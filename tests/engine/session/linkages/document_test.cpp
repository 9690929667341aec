// Edits of linkages: whole or not at all, undone and redone, refused with their field.

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "engine/base/error.h"
#include "engine/session/linkages/document.h"

namespace limber::session {
namespace {

using scene::Held;

scene::LinkageTarget at_joint(int joint, double z) {
  scene::LinkageTarget target;
  target.joint = joint;
  target.position = {0, 0, z};
  target.stiffness = 5;
  return target;
}

TEST(LinkageDocument, EditsAreOneRevisionAndOneStepOfUndo) {
  LinkageDocument document({}, 6, 7);
  const auto receipt =
      document.apply({PinJoint{2, Held::kMotion}, AddTarget{at_joint(4, 1)}, SetMeanAngle{0.8}}, 0);
  EXPECT_EQ(receipt.revision, 1u);
  EXPECT_EQ(receipt.constraint_ids, (std::vector<std::uint64_t>{0, 1, 0}));
  const auto first = document.conditions();
  EXPECT_EQ(first->pins.size(), 1u);
  EXPECT_EQ(first->targets.at(0).id, 1u);
  EXPECT_EQ(first->mean_angle, 0.8);

  EXPECT_EQ(document.apply({MoveTarget{1, {0, 0, 2}}}, {}).revision, 2u);
  EXPECT_EQ(document.conditions()->targets[0].position.z(), 2);
  EXPECT_EQ(document.apply({Undo{}}, {}).revision, 3u);
  EXPECT_EQ(document.conditions(), first);
  document.apply({Undo{}}, {});
  EXPECT_TRUE(document.conditions()->pins.empty());
  EXPECT_FALSE(document.conditions()->mean_angle);
  document.apply({Redo{}, Redo{}}, {});
  EXPECT_EQ(document.conditions()->targets.at(0).position.z(), 2);
  EXPECT_EQ(document.redo_count(), 0u);
  EXPECT_EQ(document.revision(), 5u);
}

TEST(LinkageDocument, ANewEditForgetsWhatWasUndone) {
  LinkageDocument document({}, 6, 7);
  document.apply({SetGravity{{0, 0, -9.8}}}, {});
  document.apply({Undo{}, SetMeanAngle{0.5}}, {});
  EXPECT_EQ(document.redo_count(), 0u);
  EXPECT_TRUE(document.conditions()->gravity.isZero());
  document.apply({Undo{}}, {});
  EXPECT_FALSE(document.conditions()->mean_angle);
}

TEST(LinkageDocument, PinsAnglesAndLoadsReplaceThemselves) {
  LinkageDocument document({}, 6, 7);
  document.apply(
      {PinJoint{1, Held::kMotion}, PinJoint{1, Held::kMotionAndAngle}, SetJointAngle{2, 0.3},
       SetJointAngle{2, 0.4}, SetJointLoad{{3, {1, 0, 0}, {0, 0, 0}, 0}},
       SetJointLoad{{3, {2, 0, 0}, {0, 0, 0}, 0}}},
      {});
  const auto& now = *document.conditions();
  ASSERT_EQ(now.pins.size(), 1u);
  EXPECT_EQ(now.pins[0].held, Held::kMotionAndAngle);
  ASSERT_EQ(now.angles.size(), 1u);
  EXPECT_EQ(now.angles[0].angle, 0.4);
  ASSERT_EQ(now.loads.size(), 1u);
  EXPECT_EQ(now.loads[0].force.x(), 2);
  document.apply(
      {PinJoint{1, {}}, SetJointAngle{2, {}}, SetJointLoad{{3, {0, 0, 0}, {0, 0, 0}, 0}}}, {});
  EXPECT_TRUE(document.conditions()->pins.empty());
  EXPECT_TRUE(document.conditions()->angles.empty());
  EXPECT_TRUE(document.conditions()->loads.empty());
}

TEST(LinkageDocument, ReleasesOfWhatIsNotHeldAreReported) {
  LinkageDocument document({}, 6, 7);
  const SetJointLoad none{{3, {0, 0, 0}, {0, 0, 0}, 0}};
  const auto idle = document.apply(
      {SetGravity{{0, 0, -1}}, PinJoint{1, {}}, SetJointAngle{2, {}}, SetMeanAngle{}, none}, {});
  EXPECT_EQ(idle.revision, 1u);
  const std::pair<const char*, const char*> expected[] = {
      {"edits[1].joint", "joint 1 is not pinned"},
      {"edits[2].joint", "the angle of joint 2 is not set"},
      {"edits[3].mean_angle", "the mean angle is not set"},
      {"edits[4].joint", "joint 3 carries no load"}};
  ASSERT_EQ(idle.issues.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(idle.issues[i].severity, scene::Issue::Severity::kWarning);
    EXPECT_EQ(idle.issues[i].field, expected[i].first);
    EXPECT_EQ(idle.issues[i].message.rfind(expected[i].second, 0), 0u) << idle.issues[i].message;
  }
  const auto held =
      document.apply({PinJoint{1, Held::kAngle}, SetJointAngle{2, 0.3}, SetMeanAngle{0.4},
                      SetJointLoad{{3, {0, 0, 0}, {0, 0, 0}, 1}}, SetJointAngle{1, {}}},
                     {});
  ASSERT_EQ(held.issues.size(), 1u);
  EXPECT_NE(held.issues[0].message.find("its pin holds it"), std::string::npos)
      << held.issues[0].message;
  EXPECT_TRUE(document.apply({PinJoint{1, {}}, SetJointAngle{2, {}}, SetMeanAngle{}, none}, {})
                  .issues.empty());
}

TEST(LinkageDocument, UndoIsBounded) {
  LinkageDocument document({}, 6, 7, {3, 10});
  for (int i = 1; i <= 5; ++i) document.apply({SetMeanAngle{0.1 * i}}, {});
  EXPECT_EQ(document.undo_count(), 3u);
  document.apply({Undo{}, Undo{}, Undo{}}, {});
  EXPECT_NEAR(*document.conditions()->mean_angle, 0.2, 1e-15);
}

TEST(LinkageDocument, UndoIsBoundedInBytes) {
  LinkageDocument document({}, 6, 7, {100, 50, 10'000});
  std::vector<LinkageEdit> many;
  for (int i = 0; i < 50; ++i) many.emplace_back(AddTarget{at_joint(0, i)});
  document.apply(many, {});
  for (int i = 0; i < 20; ++i) document.apply({SetMeanAngle{0.1 + 0.01 * i}}, {});
  EXPECT_GE(document.undo_count(), 1U);
  EXPECT_LT(document.undo_count(), 4U);
}

TEST(LinkageDocument, UndoReachesAsFarAsThereIsRoomForShapes) {
  LinkageLimits limits;
  limits.undo_bytes = 100'000;
  limits.shape_bytes = 19'000;
  LinkageDocument document({}, 6, 7, limits);
  for (int i = 1; i <= 20; ++i) document.apply({SetMeanAngle{0.1 + 0.01 * i}}, {});
  EXPECT_EQ(document.undo_count(), 5U);
  limits.shape_bytes = 1'000'000;  // the newest always
  LinkageDocument large({}, 6, 7, limits);
  for (int i = 1; i <= 3; ++i) large.apply({SetMeanAngle{0.1 * i}}, {});
  EXPECT_EQ(large.undo_count(), 1U);
}

TEST(LinkageDocument, SaysWhatComesBeforeAReturn) {
  LinkageDocument document({}, 6, 7);
  const auto first = document.conditions();
  document.apply({SetMeanAngle{0.2}}, {});
  const auto second = document.conditions();
  document.apply({SetMeanAngle{0.3}}, {});
  EXPECT_TRUE(document.steps_before_return().empty()) << "edits continue from where they are";
  document.apply({Undo{}}, {});
  EXPECT_EQ(document.conditions(), second);
  EXPECT_EQ(document.steps_before_return(), std::vector{first});
  document.apply({Redo{}}, {});
  EXPECT_EQ(document.steps_before_return(), (std::vector{second, first}));
  document.apply({Undo{}, SetMeanAngle{0.5}}, {});
  EXPECT_TRUE(document.steps_before_return().empty());
}

TEST(LinkageDocument, EditsOfARequestAreJudgedTogether) {
  LinkageDocument document({}, 6, 7, {});
  document.apply({PinJoint{3, Held::kAngle}}, {});
  document.apply({SetJointAngle{3, 0.2}, PinJoint{3, std::nullopt}}, {});
  EXPECT_EQ(document.conditions()->angles.size(), 1U);
  EXPECT_TRUE(document.conditions()->pins.empty());
}

TEST(LinkageDocument, ARefusedRequestLeavesEverythingAsItWas) {
  struct Case {
    std::vector<LinkageEdit> edits;
    ErrorCode code;
    const char* field;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto soft = at_joint(1, 0);
  soft.stiffness = -1;
  auto taken = at_joint(1, 0);
  taken.id = 1;
  auto last = at_joint(1, 0);
  last.id = std::numeric_limits<std::uint64_t>::max();  // no id would be left for the next
  const Case cases[] = {
      {{}, ErrorCode::kInvalidArgument, "edits"},
      {{SetMeanAngle{0.5}, PinJoint{6, Held::kMotion}}, ErrorCode::kOutOfRange, "edits[1].joint"},
      {{SetJointAngle{0, 4}}, ErrorCode::kOutOfRange, "edits[0].angle"},
      {{SetMeanAngle{nan}}, ErrorCode::kOutOfRange, "edits[0].mean_angle"},
      {{PinJoint{3, Held::kAngle}, SetJointAngle{3, 0.2}},
       ErrorCode::kInvalidArgument,
       "edits[1].joint"},
      {{AddTarget{soft}}, ErrorCode::kInvalidArgument, "edits[0].stiffness"},
      {{AddTarget{taken}}, ErrorCode::kAlreadyExists, "edits[0].id"},
      {{AddTarget{at_joint(1, 0)}, AddTarget{at_joint(2, 0)}},
       ErrorCode::kLimitExceeded,
       "edits[1].target"},
      {{AddTarget{last}}, ErrorCode::kOutOfRange, "edits[0].id"},
      {{MoveTarget{9, {0, 0, 0}}}, ErrorCode::kNotFound, "edits[0].id"},
      {{RemoveTarget{9}}, ErrorCode::kNotFound, "edits[0].id"},
      {{SetJointLoad{{0, {nan, 0, 0}, {0, 0, 0}, 0}}},
       ErrorCode::kInvalidArgument,
       "edits[0].force"},
      {{SetGravity{{nan, 0, 0}}}, ErrorCode::kInvalidArgument, "edits[0].gravity"},
      {{Redo{}}, ErrorCode::kFailedPrecondition, "edits[0]"},
  };
  LinkageDocument document({}, 6, 7, {100, 2});
  document.apply({AddTarget{at_joint(0, 1)}}, {});
  const auto before = document.conditions();
  for (const Case& item : cases) {
    try {
      document.apply(item.edits, {});
      ADD_FAILURE() << item.field;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), item.code) << item.field;
      EXPECT_EQ(error.field(), item.field);
    }
    EXPECT_EQ(document.conditions(), before);
    EXPECT_EQ(document.revision(), 1u);
    EXPECT_EQ(document.undo_count(), 1u);
  }
  EXPECT_THROW(document.apply({SetMeanAngle{0.5}}, 0), Error);
}

TEST(LinkageDocument, RefusalsNameTheJointAndSpeakInDegreesAndNewtons) {
  LinkageDocument document({}, 4, 5);
  const auto message = [&](const std::vector<LinkageEdit>& edits) -> std::string {
    try {
      document.apply(edits, {});
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({SetJointAngle{2, 4}}),
            "an angle of joint 2 of 229.183 degrees cannot be reached, must be in (-180, 180)");
  EXPECT_EQ(message({SetMeanAngle{-4}}),
            "a mean angle of -229.183 degrees cannot be reached, must be in (-180, 180)");
  const std::string rest = message({SetMeanAngle{3}, SetJointAngle{0, -3}});
  EXPECT_NE(rest.find("is 286.5 degrees, and must be in (-180, 180)"), std::string::npos) << rest;
  EXPECT_EQ(message({SetJointLoad{{3, {0, 1e200, 0}, {0, 0, 0}, 0}}}),
            "the force of joint 3 is 1e+200 N: no more than 1e+90 N can be reckoned with");
  EXPECT_EQ(message({SetJointLoad{{3, {0, 0, 0}, {0, 0, -1e91}, 0}}}),
            "the moment of joint 3 is 1e+91 N m: no more than 1e+90 N m can be reckoned with");
  EXPECT_EQ(message({SetJointLoad{{1, {0, 0, 0}, {0, 0, 0}, -1e300}}}),
            "the torque of joint 1 is 1e+300 N m: no more than 1e+90 N m can be reckoned with");
}

TEST(LinkageDocument, OpensWithConditionsThatAreNumbered) {
  scene::LinkageConditions conditions;
  conditions.targets = {at_joint(0, 1), at_joint(1, 1)};
  conditions.targets[1].id = 7;
  LinkageDocument document(conditions, 6, 7);
  EXPECT_EQ(document.conditions()->targets[0].id, 8u);
  EXPECT_EQ(document.apply({AddTarget{at_joint(2, 0)}}, {}).constraint_ids[0], 9u);
  conditions.targets[0].joint = 6;
  EXPECT_THROW(LinkageDocument(conditions, 6, 7), Error);
}

std::vector<LinkageEdit> moves_of(int targets, int count) {
  std::vector<LinkageEdit> edits;
  for (int i = 0; i < count; ++i)
    edits.emplace_back(MoveTarget{1 + static_cast<std::uint64_t>(i % targets), {0, 0, 1e-4 * i}});
  return edits;
}

TEST(LinkageDocument, AWrongLastEditOfTwentyThousandIsNamed) {
  LinkageDocument document({}, 6, 7);
  std::vector<LinkageEdit> targets(500, AddTarget{at_joint(4, 1)});
  document.apply(targets, {});
  const auto before = document.conditions();
  std::vector<LinkageEdit> edits = moves_of(500, 20'000);
  const auto refusal = [&](const LinkageEdit& last) {
    edits.resize(20'000, Undo{});
    edits.push_back(last);
    try {
      document.apply(edits, {});
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusal(MoveTarget{501, {0, 0, 0}}), "edits[20000].id");  // by itself
  EXPECT_EQ(refusal(MoveTarget{3, {0, 0, std::numeric_limits<double>::infinity()}}),
            "edits[20000].position");  // with the others
  EXPECT_EQ(refusal(Redo{}), "edits[20000]");
  EXPECT_EQ(document.conditions(), before);
  EXPECT_EQ(document.revision(), 1u);
}

TEST(LinkageDocument, UndoAndRedoInTurnComeBackToTheVerySameConditions) {
  LinkageDocument document({}, 6, 7);
  document.apply({SetMeanAngle{0.5}}, {});
  document.apply({SetMeanAngle{0.6}}, {});
  const auto before = document.conditions();
  std::vector<LinkageEdit> edits;
  for (int i = 0; i < 20'000; ++i) edits.push_back(i % 2 == 0 ? LinkageEdit(Undo{}) : Redo{});
  document.apply(edits, {});
  EXPECT_EQ(document.conditions(), before);
  EXPECT_EQ(document.undo_count(), 2u);
}

TEST(LinkageDocument, OneRequestBeginsSoManyStepsOfUndoAndNoMore) {
  LinkageLimits limits;
  limits.steps_at_once = 3;
  LinkageDocument document({}, 6, 7, limits);
  std::vector<LinkageEdit> edits;
  for (int i = 0; i < 3; ++i) {
    edits.emplace_back(SetMeanAngle{0.1 * (i + 1)});
    edits.emplace_back(Undo{});
  }
  edits.emplace_back(SetMeanAngle{0.9});
  document.apply(edits, {});
  EXPECT_EQ(document.conditions()->mean_angle, 0.9);
  EXPECT_EQ(document.undo_count(), 1u);
  edits.emplace_back(Undo{});
  try {
    document.apply(edits, {});
    ADD_FAILURE() << "it was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
    EXPECT_EQ(error.field(), "edits[7].steps_at_once");
  }
  EXPECT_EQ(document.conditions()->mean_angle, 0.9);
  EXPECT_EQ(document.revision(), 1u);
  limits.steps_at_once = -1;
  EXPECT_THROW(limits.validate(), Error);
}

}  // namespace
}  // namespace limber::session
