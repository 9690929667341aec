#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "engine/base/error.h"
#include "engine/session/bodies/edit_batch.h"
#include "tests/engine/session/bodies/document_support.h"

namespace limber::session {
namespace {

using test::edit_all;
using test::held;
using test::keyed;
using test::state_of;
using test::two_tets;
using ::testing::ElementsAre;

std::vector<int> frames(const Document& document) {
  std::vector<int> list;
  for (const auto& keyframe : document.keyframe_list()) list.push_back(keyframe.frame);
  return list;
}

Error refusal(Document& document, const std::vector<BodyEdit>& edits) {
  const auto before = state_of(document);
  try {
    edit_all(document, edits);
  } catch (const Error& error) {
    EXPECT_EQ(state_of(document), before);
    return error;
  }
  ADD_FAILURE() << "was accepted";
  return {ErrorCode::kInternal, "", ""};
}

TEST(DocumentKeyframes, AreNumberedApartAndComeAndGo) {
  scene::Scene scene = two_tets();
  scene.constraints = {held(3, 2)};
  scene.keyframes = {keyed(4), keyed(3)};
  scene.keyframes[1].id = 1;
  Document document(scene);
  EXPECT_THAT(frames(document), ElementsAre(3, 4));  // the second has the id given
  EXPECT_TRUE(document.unedited()->keyframes.empty());

  EditReceipt receipt = edit_all(document, {AddKeyframe{keyed(5, 0.1)}, MoveKeyframe{1, 6, {}},
                                            AddConstraint{held(5, 3)}, RemoveKeyframe{2}});
  EXPECT_THAT(receipt.keyframe_ids, ElementsAre(3, 1, 0, 2));
  EXPECT_THAT(receipt.constraint_ids, ElementsAre(0, 0, 2, 0));
  EXPECT_THAT(frames(document), ElementsAre(6, 5));
  // The frame is free again, the id is not.
  receipt = edit_all(document, {AddKeyframe{keyed(4)}});
  EXPECT_THAT(receipt.keyframe_ids, ElementsAre(4));
}

TEST(DocumentKeyframes, UndoBringsBackTheVeryPose) {
  scene::Scene scene = two_tets();
  scene.keyframes = {keyed(4, 0.3)};
  Document document(scene);
  const auto opened = state_of(document);
  edit_all(document, {MoveKeyframe{1, 6, 2.0}});
  const auto moved = state_of(document);
  EXPECT_EQ(moved.keyframes[0].weight, 2.0);
  edit_all(document, {RemoveKeyframe{1}});
  EXPECT_TRUE(state_of(document).keyframes.empty());
  EXPECT_THAT(edit_all(document, {Undo{}}).keyframe_ids, ElementsAre(1));
  EXPECT_EQ(state_of(document), moved);
  EXPECT_THAT(edit_all(document, {Undo{}}).keyframe_ids, ElementsAre(1));
  EXPECT_EQ(state_of(document), opened);
  edit_all(document, {Redo{}});
  EXPECT_EQ(state_of(document), moved);
}

TEST(DocumentKeyframes, WhatIsWrongIsNamed) {
  Document document(two_tets());
  edit_all(document, {AddKeyframe{keyed(4)}});
  const auto field = [&](const BodyEdit& edit) { return refusal(document, {edit}).field(); };
  scene::Keyframe bad = keyed(10);
  EXPECT_EQ(field(AddKeyframe{bad}), "edits[0].add_keyframe.keyframe.frame");
  bad = keyed(5);
  bad.weight = -1;
  EXPECT_EQ(field(AddKeyframe{bad}), "edits[0].add_keyframe.keyframe.weight");
  bad = keyed(5, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(field(AddKeyframe{bad}), "edits[0].add_keyframe.keyframe.pose");
  bad.pose = std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Zero(15));
  EXPECT_EQ(field(AddKeyframe{bad}), "edits[0].add_keyframe.keyframe.pose");
  bad = keyed(5);
  bad.id = 1;
  EXPECT_EQ(field(AddKeyframe{bad}), "edits[0].add_keyframe.keyframe.id");
  const Error taken = refusal(document, {AddKeyframe{keyed(4)}});
  EXPECT_EQ(taken.code(), ErrorCode::kAlreadyExists);
  EXPECT_EQ(taken.field(), "edits[0].add_keyframe.keyframe.frame");
  EXPECT_EQ(field(MoveKeyframe{1, -1, {}}), "edits[0].move_keyframe.frame");
  EXPECT_EQ(field(MoveKeyframe{1, {}, 0.0}), "edits[0].move_keyframe.weight");
  EXPECT_EQ(field(MoveKeyframe{9, 3, {}}), "edits[0].move_keyframe.id");
  EXPECT_EQ(field(RemoveKeyframe{9}), "edits[0].remove_keyframe.id");
  // A request that fails late leaves nothing of what it had done, the next id included.
  refusal(document, {AddKeyframe{keyed(5)}, MoveKeyframe{2, 6, {}}, RemoveKeyframe{9}});
  EXPECT_THAT(edit_all(document, {AddKeyframe{keyed(5)}}).keyframe_ids, ElementsAre(2));
}

TEST(DocumentKeyframes, ThereIsALimit) {
  scene::Scene scene = two_tets();
  scene.frame_count = 600;
  for (int frame = 0; frame < scene::kMaxKeyframes; ++frame)
    scene.keyframes.push_back(keyed(frame));
  Document document(scene);
  const Error full = refusal(document, {AddKeyframe{keyed(550)}});
  EXPECT_EQ(full.code(), ErrorCode::kLimitExceeded);
  EXPECT_EQ(full.field(), "edits[0].add_keyframe.keyframe");
  edit_all(document, {RemoveKeyframe{1}, AddKeyframe{keyed(550)}});
}

TEST(DocumentKeyframes, PosesCountAsWhatUndoKeeps) {
  scene::Scene scene = two_tets();
  DocumentLimits limits;
  limits.undo_bytes = 20 * sizeof(Change) + 20 * 144;  // a pose has 144 bytes
  Document document(scene, limits);
  for (int i = 0; i < 20; ++i) {
    edit_all(document, {AddKeyframe{keyed(5)}});
    edit_all(document, {RemoveKeyframe{static_cast<std::uint64_t>(i + 1)}});
  }
  EXPECT_LT(document.undo_count(), limits.undo_bytes / sizeof(Change));
  EXPECT_GT(document.undo_count(), 20u);
}

TEST(DocumentKeyframes, IdleFramesAreWarnedOf) {
  Document document(two_tets());
  const auto warned = [](const EditReceipt& receipt) {
    std::vector<std::string> fields;
    for (const auto& issue : receipt.issues) fields.push_back(issue.field);
    return fields;
  };
  EXPECT_THAT(warned(edit_all(document, {AddKeyframe{keyed(1)}})),
              ElementsAre("edits[0].add_keyframe.keyframe.frame"));
  EXPECT_THAT(warned(edit_all(document, {MoveKeyframe{1, 5, {}}})), ElementsAre());
  EXPECT_THAT(warned(edit_all(document, {MoveKeyframe{1, 9, {}}})),
              ElementsAre("edits[0].move_keyframe.frame"));
  EXPECT_THAT(warned(edit_all(document, {SetEnds{scene::End::kFree, scene::End::kPinnedPosition}})),
              ElementsAre("edits[0].set_ends.last_end"));
}

TEST(DocumentKeyframes, ABatchHasThemAllWhereOneHasChanged) {
  Document document(two_tets());
  Touched touched;
  document.apply({AddKeyframe{keyed(3)}, AddKeyframe{keyed(5)}}, {}, touched);
  EXPECT_FALSE(touched.empty());
  ASSERT_TRUE(batch_of(document, touched).keyframes.has_value());
  EXPECT_EQ(batch_of(document, touched).keyframes->size(), 2u);
  touched = {};
  document.apply({AddConstraint{held(3, 3)}}, {}, touched);
  EXPECT_FALSE(batch_of(document, touched).keyframes.has_value());
  EXPECT_EQ(whole_batch(document).keyframes->size(), 2u);
}

}  // namespace
}  // namespace limber::session
