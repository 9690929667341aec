// Requests of thousands of edits: what they leave behind grows with what they changed, not with
// their number, and a wrong one is named.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/engine/session/bodies/document_support.h"

namespace limber::session {
namespace {

using test::edit_all;
using test::held;
using test::keyed;
using test::state_of;
using test::with_two;

std::vector<BodyEdit> moves(int count) {
  std::vector<BodyEdit> edits;
  for (int i = 0; i < count; ++i)
    edits.emplace_back(MoveConstraint{1 + static_cast<std::uint64_t>(i % 2), {0, 0, 1e-5 * i}});
  return edits;
}

std::vector<BodyEdit> back_and_forth(int pairs) {
  std::vector<BodyEdit> edits;
  for (int i = 0; i < pairs; ++i) {
    edits.emplace_back(Undo{});
    edits.emplace_back(Redo{});
  }
  return edits;
}

TEST(DocumentBatches, AStepOfUndoTakesWhatTheThingsItChangedTake) {
  scene::Scene scene = test::two_tets();
  scene.constraints = {held(3, 2, {0.1, 0, 0}), held(4, 1, {0, 0.2, 0})};
  DocumentLimits limits;
  limits.undo_bytes =
      8 * sizeof(Change);  // of two steps of 5000 changes nothing but the newest fits
  Document document(scene, limits);
  const auto before = state_of(document);
  edit_all(document, moves(5000));
  edit_all(document, moves(4000));
  EXPECT_EQ(document.undo_count(), 2u);
  edit_all(document, {Undo{}, Undo{}});
  EXPECT_TRUE(state_of(document) == before);
}

TEST(DocumentBatches, UndoAndRedoInTurnTouchNothingAndName) {
  Document document = with_two();
  edit_all(document, moves(2000));
  edit_all(document, {MoveConstraint{2, {0.5, 0, 0}}});
  const auto last = state_of(document);
  const std::uint64_t content = document.content();
  Touched touched;
  const EditReceipt receipt = document.apply(back_and_forth(10'000), {}, touched);
  EXPECT_TRUE(touched.empty()) << "no step is made that is taken back again";
  EXPECT_TRUE(state_of(document) == last);
  EXPECT_EQ(document.content(), content);
  EXPECT_EQ(document.undo_count(), 2u);
  EXPECT_EQ(receipt.constraint_ids.front(), 2u);
  EXPECT_EQ(receipt.constraint_ids.back(), 2u);
  // Where a step is left, it is made: of two steps back and one forth the first.
  edit_all(document, {Undo{}, Undo{}, Redo{}});
  EXPECT_EQ(document.undo_count(), 1u);
  EXPECT_EQ(document.redo_count(), 1u);
  EXPECT_EQ(document.constraints().at(2).target.z(), 1e-5 * 1999);
  edit_all(document, {Redo{}});
  EXPECT_TRUE(state_of(document) == last);
}

TEST(DocumentBatches, WhatComesAndGoesInOneRequestIsAStepOfNothing) {
  Document document = with_two();
  const auto before = state_of(document);
  scene::Constraint third = held(5, 0);
  third.id = 7;
  edit_all(document, {AddConstraint{third}, MoveConstraint{7, {1e-3, 0, 0}}, RemoveConstraint{7}});
  EXPECT_TRUE(state_of(document) == before);
  EXPECT_EQ(document.undo_count(), 1u);
  edit_all(document, {Undo{}});
  EXPECT_TRUE(state_of(document) == before);
  edit_all(document, {Redo{}});
  EXPECT_TRUE(state_of(document) == before);
}

TEST(DocumentBatches, AKeyframeThatIsReplacedComesBackAsItWas) {
  scene::Scene scene = test::two_tets();
  scene.keyframes = {keyed(3, 0.1)};
  Document document(scene);
  const auto before = state_of(document);
  scene::Keyframe other = keyed(5, 0.2);
  other.id = 1;
  edit_all(document, {MoveKeyframe{1, 4, 2.0}, RemoveKeyframe{1}, AddKeyframe{other},
                      MoveKeyframe{1, 6, {}}});
  const auto after = state_of(document);
  EXPECT_EQ(document.keyframe_list().at(0).frame, 6);
  edit_all(document, {Undo{}});
  EXPECT_TRUE(state_of(document) == before);
  edit_all(document, {Redo{}});
  EXPECT_TRUE(state_of(document) == after);
}

TEST(DocumentBatches, AWrongLastEditOfTwentyThousandChangesNothing) {
  Document document = with_two();
  edit_all(document, moves(3));
  const auto before = state_of(document);
  std::vector<BodyEdit> edits = moves(10'000);
  for (const BodyEdit& edit : back_and_forth(5'000)) edits.push_back(edit);
  edits.emplace_back(MoveConstraint{99, {0, 0, 0}});
  try {
    edit_all(document, edits);
    ADD_FAILURE() << "it was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "edits[20000].move.id");
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
  }
  EXPECT_TRUE(state_of(document) == before);
  EXPECT_EQ(document.undo_count(), 1u);
  EXPECT_EQ(document.revision(), 1u);
}

TEST(DocumentBatches, OnACopyEditsComeToTheSame) {
  Document document = with_two(), other = with_two();
  Touched touched;
  std::vector<BodyEdit> edits = moves(1000);
  EXPECT_TRUE(document.is_long(edits));
  EXPECT_FALSE(document.is_long({Undo{}, MoveConstraint{1, {0, 0, 0}}}));
  Document copy = document;
  copy.apply(edits, {}, touched);
  document.exchange_edited(copy);
  edit_all(other, edits);
  EXPECT_TRUE(state_of(document) == state_of(other));
  EXPECT_EQ(document.revision(), 1u);
  EXPECT_EQ(document.content(), other.content());
  edit_all(document, {Undo{}});
  EXPECT_TRUE(state_of(document) == state_of(with_two()));
}

}  // namespace
}  // namespace limber::session
