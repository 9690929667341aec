#include "engine/session/bodies/document.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <set>

#include "engine/base/error.h"
#include "engine/scene/constraint_path.h"
#include "tests/engine/session/bodies/document_support.h"

namespace limber::session {
namespace {

using scene::End;
using test::DocumentState;
using test::edit_all;
using test::held;
using test::ids;
using test::state_of;
using test::two_tets;
using test::with_two;

TEST(Document, KeepsGivenIdsAndNumbersTheRest) {
  scene::Scene scene = two_tets();
  scene.constraints = {held(1, 0), held(2, 0), held(3, 0)};
  scene.constraints[1].id = 7;
  Document document(scene);
  EXPECT_THAT(ids(document), ::testing::ElementsAre(7, 8, 9));
  EXPECT_EQ(document.constraints().at(7).frame, 2);
  EXPECT_EQ(document.revision(), 0u);
}

TEST(Document, RefusesASceneThatNoEditCouldHaveMade) {
  scene::Scene scene = two_tets();
  scene.constraints = {held(3, 1), held(99, 1)};
  try {
    Document document(scene);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kOutOfRange);
    EXPECT_EQ(error.field(), "constraints[1].frame");
  }
  scene.constraints = {held(3, 1), held(4, 1)};
  scene.constraints[0].id = scene.constraints[1].id = 5;
  try {
    Document document(scene);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kAlreadyExists);
    EXPECT_EQ(error.field(), "constraints[1].id");
  }
  scene.constraints.resize(1);
  EXPECT_THROW(Document(scene, {.undo_depth = 1, .max_constraints = 0}), Error);
  EXPECT_THROW(Document(scene, {.undo_depth = -1}), Error);
}

TEST(Document, WhatHasNoEffectIsAcceptedWithAWarning) {
  const auto warnings_of = [](const EditReceipt& receipt) {
    std::vector<std::string> fields;
    for (const scene::Issue& issue : receipt.issues) {
      EXPECT_EQ(issue.severity, scene::Issue::Severity::kWarning);
      EXPECT_FALSE(issue.message.empty());
      fields.push_back(issue.field);
    }
    return fields;
  };
  using ::testing::ElementsAre;
  using ::testing::IsEmpty;
  Document document = with_two();
  EXPECT_THAT(warnings_of(edit_all(document, {AddConstraint{held(5, 3)}})), IsEmpty());
  EXPECT_THAT(warnings_of(edit_all(document, {AddConstraint{held(5, 0)}})),
              ElementsAre("edits[0].add.constraint.nodes"));
  // The mean of a group with one node that can move can be moved.
  scene::Constraint group = held(5, 0);
  group.nodes = {0, 3};
  EXPECT_THAT(warnings_of(edit_all(document, {AddConstraint{group}})), IsEmpty());
  scene::Constraint late = held(8, 3);  // of 10 frames, the last two of which are held
  late.id = 3;
  EXPECT_THAT(warnings_of(edit_all(document, {AddConstraint{held(1, 2)}, ReplaceConstraint{late}})),
              ElementsAre("edits[0].add.constraint.frame", "edits[0].add.constraint.nodes",
                          "edits[1].replace.constraint.frame"));
  // What counts is how things are after the last edit of the request.
  EXPECT_THAT(
      warnings_of(edit_all(document, {AddConstraint{held(9, 3)}, SetEnds{End::kFree, End::kFree}})),
      IsEmpty());
  EXPECT_THAT(warnings_of(edit_all(document, {SetEnds{End::kFree, End::kPinnedPosition}})),
              ElementsAre("edits[0].set_ends.last_end"));
  EXPECT_THAT(warnings_of(edit_all(document, {MoveConstraint{1, {0, 0, 0}}})), IsEmpty());
}

TEST(Document, AddMoveReplaceRemove) {
  Document document = with_two();
  EditReceipt receipt = edit_all(document, {AddConstraint{held(5, 0)}});
  EXPECT_EQ(receipt.revision, 1u);
  EXPECT_THAT(receipt.constraint_ids, ::testing::ElementsAre(3));

  receipt = edit_all(document, {MoveConstraint{3, {1, 2, 3}}, RemoveConstraint{1},
                                SetEnds{End::kFree, End::kFree}});
  EXPECT_EQ(receipt.revision, 2u);
  EXPECT_THAT(receipt.constraint_ids, ::testing::ElementsAre(3, 1, 0));
  EXPECT_EQ(document.constraints().at(3).target, Eigen::Vector3d(1, 2, 3));
  EXPECT_THAT(ids(document), ::testing::ElementsAre(2, 3));

  scene::Constraint other = held(6, 2);
  other.id = 2;
  other.weight = std::numeric_limits<double>::infinity();
  edit_all(document, {ReplaceConstraint{other}});
  EXPECT_TRUE(test::same(document.constraints().at(2), other));
  // Ids are never given twice, even when the newest was removed.
  edit_all(document, {RemoveConstraint{3}});
  EXPECT_THAT(edit_all(document, {AddConstraint{held(5, 0)}}).constraint_ids,
              ::testing::ElementsAre(4));
}

TEST(Document, NumbersPastTheLargestId) {
  Document document(two_tets());
  scene::Constraint last = held(3, 0);
  last.id = std::numeric_limits<std::uint64_t>::max();
  edit_all(document, {AddConstraint{last}});
  EXPECT_THAT(
      edit_all(document, {AddConstraint{held(3, 0)}, AddConstraint{held(4, 0)}}).constraint_ids,
      ::testing::ElementsAre(1, 2));
}

TEST(Document, RefusedUndoInsideARequestTakesEverythingBack) {
  Document document = with_two();
  const DocumentState opened = state_of(document);
  edit_all(document, {MoveConstraint{1, {5, 5, 5}}});
  const DocumentState moved = state_of(document);
  try {
    edit_all(document, {RemoveConstraint{2}, Undo{}, Undo{}, Undo{}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_EQ(error.field(), "edits[3].undo");
  }
  EXPECT_TRUE(state_of(document) == moved);
  EXPECT_EQ(document.undo_count(), 1u);
  EXPECT_EQ(document.redo_count(), 0u);
  edit_all(document, {Undo{}});
  EXPECT_TRUE(state_of(document) == opened);
}

TEST(Document, NothingToUndoOrRedo) {
  Document document = with_two();
  for (const auto& [edit, field] : std::vector<std::pair<BodyEdit, std::string>>{
           {Undo{}, "edits[0].undo"}, {Redo{}, "edits[0].redo"}}) {
    try {
      edit_all(document, {edit});
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
      EXPECT_EQ(error.field(), field);
    }
  }
  EXPECT_EQ(document.revision(), 0u);
}

TEST(Document, EmptyRequestAndWrongRevision) {
  Document document = with_two();
  Touched touched;
  EXPECT_THROW(document.apply({}, {}, touched), Error);
  EXPECT_EQ(document.apply({MoveConstraint{1, {1, 0, 0}}}, 0, touched).revision, 1u);
  try {
    document.apply({MoveConstraint{1, {2, 0, 0}}}, 0, touched);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_EQ(error.field(), "expected_revision");
  }
  EXPECT_EQ(document.constraints().at(1).target.x(), 1);
}

TEST(Document, LimitOnConstraints) {
  Document document(two_tets(), {.undo_depth = 10, .max_constraints = 2});
  edit_all(document, {AddConstraint{held(3, 0)}, AddConstraint{held(4, 0)}});
  try {
    edit_all(document, {RemoveConstraint{1}, AddConstraint{held(3, 0)}, AddConstraint{held(4, 0)}});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
    EXPECT_EQ(error.field(), "edits[2].add.constraint");
  }
  EXPECT_THAT(ids(document), ::testing::ElementsAre(1, 2));
}

TEST(Document, EndsMustLeaveAFrame) {
  scene::Scene scene = two_tets();
  scene.frame_count = 3;
  scene.first_end = scene.last_end = End::kPinnedPosition;
  Document document(scene);
  EXPECT_THROW(edit_all(document, {SetEnds{End::kPinnedPositionVelocity, End::kPinnedPosition}}),
               Error);
  edit_all(document, {SetEnds{End::kPinnedPositionVelocity, End::kFree}});
  scene.last_end = End::kPinnedPositionVelocity;
  EXPECT_THROW(Document{scene}, Error);
}

TEST(Document, UndoIsBounded) {
  scene::Scene scene = two_tets();
  scene.constraints = {held(3, 1)};
  Document document(scene, {.undo_depth = 3});
  for (int i = 1; i <= 10; ++i) edit_all(document, {MoveConstraint{1, {double(i), 0, 0}}});
  for (int i = 0; i < 3; ++i) edit_all(document, {Undo{}});
  EXPECT_EQ(document.constraints().at(1).target.x(), 7);
  EXPECT_THROW(edit_all(document, {Undo{}}), Error);
  EXPECT_EQ(document.revision(), 13u);

  Document none(scene, {.undo_depth = 0});
  edit_all(none, {MoveConstraint{1, {1, 0, 0}}});
  EXPECT_THROW(edit_all(none, {Undo{}}), Error);
}

TEST(Document, UndoIsBoundedInBytesToo) {
  const auto undone = [](std::size_t bytes) {
    DocumentLimits limits;
    limits.undo_bytes = bytes;
    Document document(test::two_tets(), limits);
    scene::Constraint group = held(3, 0);
    group.nodes = {0, 1, 2, 3, 4};
    group.id = edit_all(document, {AddConstraint{group}}).constraint_ids[0];
    for (int i = 0; i < 9; ++i) edit_all(document, {ReplaceConstraint{group}});
    std::size_t steps = 0;
    for (; document.undo_count() > 0; ++steps) edit_all(document, {Undo{}});
    EXPECT_EQ(document.redo_count(), steps);
    return steps;
  };
  const std::size_t step = sizeof(Change) + 5 * sizeof(int);
  EXPECT_EQ(undone(1 << 20), 10u);
  EXPECT_EQ(undone(4 * step), 4u);
  EXPECT_EQ(undone(0), 1u) << "the newest step can always be taken back";
}

TEST(Document, NodesOfAllConstraintsAreBounded) {
  DocumentLimits limits;
  limits.max_nodes = 5;
  Document document(test::two_tets(), limits);
  scene::Constraint pair = held(3, 0);
  pair.nodes = {0, 1};
  pair.id = edit_all(document, {AddConstraint{pair}, AddConstraint{pair}}).constraint_ids[0];
  scene::Constraint three = pair;
  three.nodes = {0, 1, 2};
  edit_all(document, {ReplaceConstraint{three}});
  scene::Constraint four = pair;
  four.nodes = {0, 1, 2, 3};
  for (const BodyEdit& edit :
       {BodyEdit(ReplaceConstraint{four}), BodyEdit(AddConstraint{held(4, 1)})}) {
    try {
      edit_all(document, {edit});
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
      EXPECT_TRUE(error.field().ends_with(".constraint.nodes")) << error.field();
    }
  }
  edit_all(document, {RemoveConstraint{pair.id}});
  edit_all(document, {AddConstraint{held(4, 1)}});
  edit_all(document, {Undo{}, Undo{}});
  EXPECT_THROW(edit_all(document, {AddConstraint{held(4, 1)}}), Error);
  scene::Scene scene = test::two_tets();
  scene.constraints = {three, four};
  scene.constraints[1].id = 9;
  EXPECT_THROW(Document(scene, limits), Error);
}

TEST(Document, UndoNamesTheOneConstraintItTouched) {
  Document document = with_two();
  edit_all(document, {MoveConstraint{2, {1, 0, 0}}});
  edit_all(document, {MoveConstraint{1, {1, 0, 0}}, MoveConstraint{2, {2, 0, 0}}});
  EXPECT_THAT(edit_all(document, {Undo{}, Undo{}}).constraint_ids, ::testing::ElementsAre(0, 2));
}

TEST(Document, TouchedIsCoalesced) {
  Document document = with_two();
  Touched touched;
  for (int i = 0; i < 1000; ++i)
    document.apply({MoveConstraint{1, {double(i), 0, 0}}}, {}, touched);
  ASSERT_EQ(touched.constraints.size(), 1u);
  EXPECT_EQ(touched.constraints.at(1), Touched::How::kTargetOnly);
  document.apply({RemoveConstraint{1}}, {}, touched);
  EXPECT_EQ(touched.constraints.at(1), Touched::How::kAnything);
  document.apply({Undo{}, MoveConstraint{1, {0, 0, 0}}}, {}, touched);
  EXPECT_EQ(touched.constraints.at(1), Touched::How::kAnything);
  EXPECT_FALSE(touched.ends || touched.dynamics);
  document.apply({SetEnds{End::kFree, End::kFree}, SetDynamics{}}, {}, touched);
  EXPECT_TRUE(touched.ends && touched.dynamics);
}

/// The same rules by brute force: whole copies of the state.
class NaiveModel {
 public:
  explicit NaiveModel(DocumentState state) : state_(std::move(state)) {
    for (const auto& constraint : state_.constraints) next_ = std::max(next_, constraint.id + 1);
  }
  bool apply(const std::vector<BodyEdit>& edits) {
    const NaiveModel before = *this;
    bool open = false;
    for (const BodyEdit& edit : edits) {
      if (!one(edit, open)) {
        *this = before;
        return false;
      }
    }
    return true;
  }
  [[nodiscard]] const DocumentState& state() const { return state_; }

 private:
  bool one(const BodyEdit& edit, bool& open) {
    if (std::holds_alternative<Undo>(edit) || std::holds_alternative<Redo>(edit)) {
      auto& from = std::holds_alternative<Undo>(edit) ? past_ : future_;
      auto& to = std::holds_alternative<Undo>(edit) ? future_ : past_;
      open = false;
      if (from.empty()) return false;
      to.push_back(state_);
      state_ = from.back();
      from.pop_back();
      return true;
    }
    const DocumentState before = state_;
    if (!change(edit)) return false;
    if (!open) past_.push_back(before);
    open = true;
    future_.clear();
    return true;
  }
  bool change(const BodyEdit& edit) {
    auto& list = state_.constraints;
    const auto find = [&](std::uint64_t id) {
      return std::find_if(list.begin(), list.end(), [&](const auto& c) { return c.id == id; });
    };
    if (const auto* add = std::get_if<AddConstraint>(&edit)) {
      scene::Constraint constraint = add->constraint;
      if (constraint.id == 0) constraint.id = next_;
      if (find(constraint.id) != list.end()) return false;
      next_ = std::max(next_, constraint.id + 1);
      list.push_back(constraint);
      std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    } else if (const auto* move = std::get_if<MoveConstraint>(&edit)) {
      if (find(move->id) == list.end()) return false;
      scene::move_path(*find(move->id), move->target);
    } else if (const auto* replace = std::get_if<ReplaceConstraint>(&edit)) {
      if (find(replace->constraint.id) == list.end()) return false;
      *find(replace->constraint.id) = replace->constraint;
    } else if (const auto* remove = std::get_if<RemoveConstraint>(&edit)) {
      if (find(remove->id) == list.end()) return false;
      list.erase(find(remove->id));
    } else if (const auto* ends = std::get_if<SetEnds>(&edit)) {
      if ((ends->first == End::kCyclic) != (ends->last == End::kCyclic)) return false;
      state_.first = ends->first;
      state_.last = ends->last;
    } else if (const auto* dynamics = std::get_if<SetDynamics>(&edit)) {
      state_.dynamics = dynamics->dynamics.resolved(state_.dynamics.discretisation);
    } else {
      return change_keyframe(edit);
    }
    return true;
  }
  bool change_keyframe(const BodyEdit& edit) {
    auto& list = state_.keyframes;
    const auto taken = [&](int frame, std::uint64_t self) {
      return std::any_of(list.begin(), list.end(),
                         [&](const auto& k) { return k.frame == frame && k.id != self; });
    };
    const auto find = [&](std::uint64_t id) {
      return std::find_if(list.begin(), list.end(), [&](const auto& k) { return k.id == id; });
    };
    if (const auto* add = std::get_if<AddKeyframe>(&edit)) {
      if (taken(add->keyframe.frame, 0)) return false;
      list.push_back(add->keyframe);
      list.back().id = next_keyframe_++;
    } else if (const auto* move = std::get_if<MoveKeyframe>(&edit)) {
      if (find(move->id) == list.end() || taken(*move->frame, move->id)) return false;
      find(move->id)->frame = *move->frame;
    } else if (const auto* remove = std::get_if<RemoveKeyframe>(&edit)) {
      if (find(remove->id) == list.end()) return false;
      list.erase(find(remove->id));
    }
    return true;
  }
  DocumentState state_;
  std::vector<DocumentState> past_, future_;
  std::uint64_t next_ = 1, next_keyframe_ = 1;
};

TEST(Document, RandomEditsAgreeWithWholeCopies) {
  Random random(20);
  int accepted = 0, refused = 0;
  for (int run = 0; run < 40; ++run) {
    Document document = with_two();
    NaiveModel naive(state_of(document));
    Revision revision = 0;
    for (int request = 0; request < 250; ++request) {
      std::vector<BodyEdit> edits;
      for (int count = 1 + test::below(random, 4) * test::below(random, 2); count > 0; --count)
        edits.push_back(test::random_edit(random));
      bool ok = true;
      try {
        edit_all(document, edits);
      } catch (const Error&) {
        ok = false;
      }
      ASSERT_EQ(naive.apply(edits), ok) << run << " " << request;
      ASSERT_TRUE(state_of(document) == naive.state()) << run << " " << request;
      revision += ok;
      ASSERT_EQ(document.revision(), revision);
      (ok ? accepted : refused) += 1;
    }
  }
  EXPECT_GT(accepted, 3000);
  EXPECT_GT(refused, 500);
}

TEST(Document, LongRandomRequestsAgreeWithWholeCopies) {
  Random random(21);
  int accepted = 0;
  for (int run = 0; run < 10; ++run) {
    Document document = with_two();
    NaiveModel naive(state_of(document));
    for (int request = 0; request < 40; ++request) {
      std::vector<BodyEdit> edits;
      NaiveModel trial = naive;
      for (int count = 1 + test::below(random, 60); count > 0; --count) {
        edits.push_back(test::random_edit(random));
        if (!trial.apply({edits.back()})) edits.pop_back();
      }
      if (edits.empty()) continue;
      bool ok = true;
      try {
        edit_all(document, edits);
      } catch (const Error&) {
        ok = false;
      }
      ASSERT_EQ(naive.apply(edits), ok) << run << " " << request;
      ASSERT_TRUE(state_of(document) == naive.state()) << run << " " << request;
      accepted += ok;
    }
    // Every step, back to the scene as opened and forth again.
    const DocumentState last = state_of(document);
    const auto steps = document.undo_count();
    const std::vector<BodyEdit> undos(steps, Undo{}), redos(steps, Redo{});
    if (steps == 0) continue;
    ASSERT_TRUE(naive.apply(undos));
    edit_all(document, undos);
    ASSERT_TRUE(state_of(document) == naive.state()) << run;
    edit_all(document, redos);
    ASSERT_TRUE(state_of(document) == last) << run;
  }
  EXPECT_GT(accepted, 200);
}

}  // namespace
}  // namespace limber::session
