#include "engine/session/beams/document.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "engine/base/error.h"
#include "tests/engine/session/beams/scenes.h"

namespace limber::session {
namespace {

class Nowhere final : public BeamDocument::Places {
 public:
  [[nodiscard]] beams::PrescribedMotion of(int) const override {
    throw Error(ErrorCode::kFailedPrecondition, "node", "nobody knows");
  }
};
class Lifted final : public BeamDocument::Places {
 public:
  [[nodiscard]] beams::PrescribedMotion of(int node) const override {
    return {node, {true, true, true}, {0, 0, 0.25}, {true, true, true}, {0.5, 0, 0}};
  }
};

struct EditedBeams {
  BeamDocument document{test::cantilever(6, 1)};
  EditReceipt apply(const std::vector<BeamEdit>& edits) {
    return document.apply(edits, {}, Nowhere());
  }
  [[nodiscard]] const BeamConditions& now() const { return *document.conditions(); }
};

/// What a refusal says; the document must not have changed.
Error refusal(BeamDocument& document, const std::vector<BeamEdit>& edits) {
  const auto before = document.conditions();
  const Revision revision = document.revision();
  try {
    (void)document.apply(edits, {}, Nowhere());
  } catch (const Error& error) {
    EXPECT_EQ(document.conditions(), before);
    EXPECT_EQ(document.revision(), revision);
    return error;
  }
  ADD_FAILURE() << "it was accepted";
  return {ErrorCode::kInternal, "", ""};
}

TEST(BeamDocument, AMotionTakesOverWhatItGivesAndLeavesTheRest) {
  EditedBeams edited;
  EXPECT_EQ(edited.apply({MoveNode{test::moved(0, {}, {}, 0.1)}}).revision, 1U);
  ASSERT_EQ(edited.now().supports.size(), 1U);
  EXPECT_EQ(edited.now().supports[0].fixed,
            (std::array<bool, 6>{true, true, false, true, true, true}));
  ASSERT_EQ(edited.now().motions.size(), 1U);
  EXPECT_EQ(edited.now().motions[0].translation.z(), 0.1);
  edited.apply({MoveNode{test::moved(0, 0.2, {}, {})}});
  ASSERT_EQ(edited.now().motions.size(), 1U);
  EXPECT_EQ(edited.now().motions[0].translation, Eigen::Vector3d(0.2, 0, 0.1));
  edited.apply({MoveNode{test::turned(0, {0, 0.3, 0})}});
  EXPECT_EQ(edited.now().supports[0].fixed,
            (std::array<bool, 6>{false, true, false, false, false, false}));
  EXPECT_TRUE(edited.now().motions[0].rotates_all());
}

/// Turned by 30 degrees about z.
Eigen::Matrix3d slope() { return Eigen::AngleAxisd(0.5236, Eigen::Vector3d::UnitZ()).matrix(); }

TEST(BeamDocument, MotionsAreByTheAxesOfWhatHoldsTheNode) {
  EditedBeams edited;
  beams::BeamSupport support{6, {true, true, true, true, true, true}, slope()};
  edited.apply({SetSupport{support}});
  // Along the slope: the support keeps the rest.
  beams::PrescribedMotion along = test::moved(6, 0.2, {}, {});
  along.axes = slope();
  edited.apply({MoveNode{along}});
  EXPECT_EQ(edited.now().supports[1].fixed,
            (std::array<bool, 6>{false, true, true, true, true, true}));
  // z is the same for both, x is not.
  edited.apply({MoveNode{test::moved(6, {}, {}, 0.3)}});
  EXPECT_EQ(edited.now().motions[0].translates, (std::array<bool, 3>{true, false, true}));
  EXPECT_TRUE(edited.now().motions[0].axes.isApprox(slope()));
  EXPECT_EQ(refusal(edited.document, {MoveNode{test::moved(6, 0.1, {}, {})}}).field(), "edits[0]");
  // One rotation alone, and all three of anything by any axes.
  beams::PrescribedMotion about_y = along;
  about_y.translates = {};
  about_y.rotates = {false, true, false};
  about_y.rotation = {0, 0.4, 0};
  edited.apply({MoveNode{about_y}});
  EXPECT_EQ(edited.now().supports[1].fixed,
            (std::array<bool, 6>{false, true, false, true, false, true}));
  edited.apply({MoveNode{test::moved(6, 0.1, 0.0, 0.0)}});
  ASSERT_EQ(edited.now().motions.size(), 1U);
  const Eigen::Vector3d expected = slope().transpose() * Eigen::Vector3d(0.1, 0, 0);
  EXPECT_LT((edited.now().motions[0].translation - expected).norm(), 1e-15);
  EXPECT_NEAR(edited.now().motions[0].rotation.y(), 0.4, 1e-15);
}

TEST(BeamDocument, NodesAreHeldByTheAxesOfWhatHoldsThem) {
  EditedBeams edited;
  edited.apply({SetSupport{{6, {true, false, false, false, false, false}, slope()}}});
  HoldNode across{6};
  across.translations = {false, true, false};
  across.rotations = false;
  edited.document.apply({across}, {}, Lifted());
  EXPECT_EQ(edited.now().motions[0].translates, (std::array<bool, 3>{false, true, false}));
  EXPECT_TRUE(edited.now().motions[0].axes.isApprox(slope()));
  EXPECT_EQ(edited.now().supports.size(), 2U);
}

TEST(BeamDocument, NodesAreHeldWhereTheyAre) {
  EditedBeams edited;
  edited.document.apply({HoldNode{6}}, {}, Lifted());
  ASSERT_EQ(edited.now().motions.size(), 1U);
  EXPECT_EQ(edited.now().motions[0].node, 6);
  EXPECT_EQ(edited.now().motions[0].translation.z(), 0.25);
  EXPECT_EQ(edited.now().motions[0].rotation.x(), 0.5);
  EXPECT_EQ(refusal(edited.document, {HoldNode{3}}).code(), ErrorCode::kFailedPrecondition);
}

class TurnedFar final : public BeamDocument::Places {
 public:
  /// As an attitude tells a turn by -4 rad.
  [[nodiscard]] beams::PrescribedMotion of(int node) const override {
    return {node, {true, true, true}, {0, 0, 0}, {true, true, true}, {0, 6.283185307179586 - 4, 0}};
  }
};

TEST(BeamDocument, WhatHasTurnedFarIsHeldAsFar) {
  EditedBeams edited;
  edited.apply({MoveNode{test::turned(6, {0, -4, 0})}});
  edited.document.apply({HoldNode{6}}, {}, TurnedFar());
  EXPECT_NEAR(edited.now().motions[0].rotation.y(), -4, 1e-12);
}

TEST(BeamDocument, LoadsReplaceEachOtherAndZerosTakeThemAway) {
  EditedBeams edited;
  edited.apply({SetNodeLoad{test::force_on(6, 0, 0, -2)}, SetElementLoad{{2, {0, 0, -3}}},
                SetGravity{{0, 0, -9.81}}});
  ASSERT_EQ(edited.now().loads.size(), 1U);
  EXPECT_EQ(edited.now().loads[0].force.z(), -2);
  EXPECT_EQ(edited.now().distributed_loads.size(), 1U);
  edited.apply({SetNodeLoad{test::force_on(6)}, SetElementLoad{{2, {0, 0, 0}}}});
  EXPECT_TRUE(edited.now().loads.empty());
  EXPECT_TRUE(edited.now().distributed_loads.empty());
  EXPECT_EQ(edited.now().gravity.z(), -9.81);
}

TEST(BeamDocument, PushesAreOfOneRequest) {
  EditedBeams edited;
  edited.apply({PushNode{test::force_on(3, 0, 0, 1)}, PushNode{test::force_on(4, 0, 0, 1)}});
  EXPECT_EQ(edited.now().temporary_loads.size(), 2U);
  edited.apply({SetGravity{{0, 0, -1}}});
  EXPECT_TRUE(edited.now().temporary_loads.empty());
}

TEST(BeamDocument, WhatHasNoEffectWarns) {
  EditedBeams edited;  // without a density
  EditReceipt receipt =
      edited.apply({SetNodeLoad{test::force_on(2, 0, 0, -1)}, SetGravity{{0, 0, -9.81}}});
  ASSERT_EQ(receipt.issues.size(), 1U);
  EXPECT_EQ(receipt.issues[0].severity, scene::Issue::Severity::kWarning);
  EXPECT_EQ(receipt.issues[0].field, "edits[1].gravity");
  EXPECT_TRUE(edited.apply({SetGravity{{0, 0, 0}}}).issues.empty());
  receipt = edited.apply({ReleaseNode{3}, MoveNode{test::moved(4, 0.0, {}, {})}, ReleaseNode{4}});
  ASSERT_EQ(receipt.issues.size(), 1U);
  EXPECT_EQ(receipt.issues[0].field, "edits[0].node");
  EXPECT_NE(receipt.issues[0].message.find("node 3"), std::string::npos);
  receipt = edited.apply({SetNodeLoad{test::force_on(2)}, SetNodeLoad{test::force_on(2)},
                          SetElementLoad{{1, {0, 0, 0}}}});
  ASSERT_EQ(receipt.issues.size(), 2U);
  EXPECT_EQ(receipt.issues[0].field, "edits[1].node");
  EXPECT_EQ(receipt.issues[0].message, "nothing loads node 2: there is nothing to take away");
  EXPECT_EQ(receipt.issues[1].field, "edits[2].element");
  EXPECT_EQ(receipt.issues[1].message, "nothing loads element 1: there is nothing to take away");
  beams::BeamModel heavy = test::cantilever(6, 1);
  heavy.sections[0].mass_per_length = 1;
  EXPECT_TRUE(BeamDocument(heavy).apply({SetGravity{{0, 0, -9.81}}}, {}, Nowhere()).issues.empty());
}

TEST(BeamDocument, UndoComesBackToTheVerySameConditions) {
  EditedBeams edited;
  const auto first = edited.document.conditions();
  edited.apply({SetGravity{{0, 0, -1}}, SetNodeLoad{test::force_on(2, 1, 0, 0)}});
  const auto second = edited.document.conditions();
  EXPECT_EQ(edited.apply({Undo{}}).revision, 2U);
  EXPECT_EQ(edited.document.conditions(), first);
  edited.apply({Redo{}});
  EXPECT_EQ(edited.document.conditions(), second);
  EXPECT_EQ(refusal(edited.document, {Redo{}}).code(), ErrorCode::kFailedPrecondition);
  edited.apply({Undo{}, SetGravity{{0, 0, -2}}});
  EXPECT_EQ(edited.document.redo_count(), 0U);
  EXPECT_EQ(edited.document.undo_count(), 1U);
}

TEST(BeamDocument, ContradictionsAreRefusedByTheEditThatMakesThem) {
  EditedBeams edited;
  // Held by a motion first, then by a support as well.
  Error error = refusal(
      edited.document,
      {SetGravity{{0, 0, -1}}, MoveNode{test::moved(6, {}, {}, 0.1)}, SetSupport{test::held(6)}});
  EXPECT_EQ(error.field(), "edits[2]");
  EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
  EXPECT_NE(std::string(error.what()).find("node 6"), std::string::npos) << error.what();
  error = refusal(edited.document, {SetNodeLoad{test::force_on(7, 0, 0, 1)}});
  EXPECT_EQ(error.field(), "edits[0].node");
  EXPECT_EQ(error.code(), ErrorCode::kOutOfRange);
  error = refusal(edited.document, {SetElementLoad{{6, {0, 0, 1}}}});
  EXPECT_EQ(error.field(), "edits[0].element");
  error = refusal(edited.document, {ReleaseNode{0}});
  EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition) << "nothing holds it then";
  error = refusal(edited.document, {MoveNode{test::moved(2, {}, {}, {})}});
  EXPECT_EQ(error.field(), "edits[0].node");
  error = refusal(edited.document, {SetNodeLoad{test::force_on(2, 0, 0, std::nan(""))}});
  EXPECT_EQ(error.field(), "edits[0].force");
  error = refusal(edited.document, {});
  EXPECT_EQ(error.field(), "edits");
  // What only an order makes wrong is not wrong: released first, held elsewhere after.
  edited.apply({ReleaseNode{0}, SetSupport{test::held(3)}});
  EXPECT_EQ(edited.now().supports.at(0).node, 3);
}

TEST(BeamDocument, SupportsWithAxesOfTheirOwnAreNotMovedAlongX) {
  EditedBeams edited;
  beams::BeamSupport slope = test::held(6);
  slope.axes = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()).toRotationMatrix();
  edited.apply({SetSupport{slope}});
  const Error error = refusal(edited.document, {MoveNode{test::moved(6, 0.1, {}, {})}});
  EXPECT_EQ(error.field(), "edits[0]");
  edited.apply({ReleaseNode{6}, MoveNode{test::moved(6, 0.1, {}, {})}});
}

TEST(BeamDocument, ExpectedRevisionsAndLimitsAreKept) {
  BeamDocument document(test::cantilever(4, 1), {2});
  for (int i = 0; i < 4; ++i)
    document.apply({SetGravity{{0, 0, -1.0 - i}}}, static_cast<Revision>(i), Nowhere());
  EXPECT_EQ(document.undo_count(), 2U);
  try {
    document.apply({Undo{}}, 3, Nowhere());
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "expected_revision");
  }
  EXPECT_THROW(BeamLimits{-1}.validate(), Error);
}

TEST(BeamDocument, AWrongLastEditOfTwentyThousandIsNamed) {
  BeamDocument document(test::cantilever(300, 1));
  std::vector<BeamEdit> edits;
  for (int i = 0; i < 20'000; ++i)
    edits.emplace_back(MoveNode{test::moved(1 + i % 300, {}, {}, 1e-6 * i)});
  edits.emplace_back(SetNodeLoad{test::force_on(301, 0, 0, 1)});  // by itself
  EXPECT_EQ(refusal(document, edits).field(), "edits[20000].node");
  edits.back() = MoveNode{test::moved(3, {}, std::numeric_limits<double>::infinity(), {})};
  EXPECT_EQ(refusal(document, edits).field(), "edits[20000]");  // with the others
  edits.back() = Redo{};
  EXPECT_EQ(refusal(document, edits).field(), "edits[20000]");
  edits.pop_back();
  document.apply(edits, {}, Nowhere());
  ASSERT_EQ(document.conditions()->motions.size(), 300u);
  EXPECT_EQ(document.conditions()->motions[0].node, 1);
  EXPECT_EQ(document.conditions()->motions[299].translation.z(), 1e-6 * 19'799);
}

TEST(BeamDocument, UndoAndRedoInTurnComeBackToTheVerySameConditions) {
  EditedBeams edited;
  edited.apply({SetNodeLoad{test::force_on(3, 0, 0, 1)}});
  const auto before = edited.document.conditions();
  std::vector<BeamEdit> edits;
  for (int i = 0; i < 20'000; ++i) edits.push_back(i % 2 == 0 ? BeamEdit(Undo{}) : Redo{});
  edited.apply(edits);
  EXPECT_EQ(edited.document.conditions(), before);
  EXPECT_EQ(edited.document.undo_count(), 1u);
}

TEST(BeamDocument, OneRequestBeginsSoManyStepsOfUndoAndNoMore) {
  EditedBeams edited;
  std::vector<BeamEdit> edits;
  for (int i = 0; i < BeamLimits{}.steps_at_once; ++i) {
    edits.emplace_back(SetNodeLoad{test::force_on(3, 0, 0, 1 + i)});
    edits.emplace_back(Undo{});
  }
  edited.apply(edits);
  EXPECT_EQ(edited.document.redo_count(), 1u);
  edits.emplace_back(SetNodeLoad{test::force_on(3, 0, 0, 1)});
  edits.emplace_back(Undo{});
  const Error error = refusal(edited.document, edits);
  EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
  EXPECT_EQ(error.field(), "edits[33].steps_at_once");
}

}  // namespace
}  // namespace limber::session
