// Every fault that an edit can have.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "engine/base/error.h"
#include "tests/engine/session/bodies/document_support.h"

namespace limber::session {
namespace {

using scene::End;
using test::DocumentState;
using test::edit_all;
using test::held;
using test::ids;
using test::kInfinity;
using test::state_of;
using test::with_two;

struct BadEdit {
  const char* name;
  std::function<BodyEdit()> edit;
  ErrorCode code;
  const char* field;
};
std::ostream& operator<<(std::ostream& out, const BadEdit& bad) { return out << bad.name; }

BodyEdit spoiled(const std::function<void(scene::Constraint&)>& spoil) {
  scene::Constraint constraint = held(5, 1);
  spoil(constraint);
  return AddConstraint{constraint};
}

BodyEdit point(const std::function<void(scene::Constraint&)>& spoil) {
  return spoiled([&](scene::Constraint& constraint) {
    constraint.nodes.clear();
    constraint.point = scene::SurfacePoint{2, {0.5, 0.25, 0.25}};
    spoil(constraint);
  });
}

BodyEdit dynamics(double fps, double period, double damping) {
  return SetDynamics{{fps, period, damping}};
}

const double kNan = std::numeric_limits<double>::quiet_NaN();

const std::vector<BadEdit>& bad_edits() {
  using C = scene::Constraint;
  using E = ErrorCode;
  static const std::vector<BadEdit> kBad = {
      {"FrameBelow", [] { return spoiled([](C& c) { c.frame = -1; }); }, E::kOutOfRange,
       "edits[1].add.constraint.frame"},
      {"FrameAbove", [] { return spoiled([](C& c) { c.frame = 10; }); }, E::kOutOfRange,
       "edits[1].add.constraint.frame"},
      {"NoNode", [] { return spoiled([](C& c) { c.nodes = {}; }); }, E::kInvalidArgument,
       "edits[1].add.constraint.nodes"},
      {"PointBesideNodes", [] { return spoiled([](C& c) { c.point = scene::SurfacePoint(); }); },
       E::kInvalidArgument, "edits[1].add.constraint.point"},
      {"VertexBesideNodes", [] { return spoiled([](C& c) { c.surface_vertex = 0; }); },
       E::kInvalidArgument, "edits[1].add.constraint.surface_vertex"},
      {"VertexBesidePoint", [] { return point([](C& c) { c.surface_vertex = 0; }); },
       E::kInvalidArgument, "edits[1].add.constraint.surface_vertex"},
      {"VertexOfNoSurface",
       [] {
         return point([](C& c) {
           c.point.reset();
           c.surface_vertex = 0;
         });
       },
       E::kInvalidArgument, "edits[1].add.constraint.surface_vertex"},
      {"PointOfNoSurface",
       [] { return point([](C& c) { c.point->surface = scene::PointSurface::kCarried; }); },
       E::kInvalidArgument, "edits[1].add.constraint.point.surface"},
      {"TriangleBelow", [] { return point([](C& c) { c.point->triangle = -1; }); }, E::kOutOfRange,
       "edits[1].add.constraint.point.triangle"},
      {"TriangleAbove", [] { return point([](C& c) { c.point->triangle = 6; }); }, E::kOutOfRange,
       "edits[1].add.constraint.point.triangle"},
      {"WeightBelow", [] { return point([](C& c) {
                             c.point->weights = {0.5, 0.6, -0.1};
                           }); },
       E::kInvalidArgument, "edits[1].add.constraint.point.weights[2]"},
      {"WeightIsNan", [] { return point([](C& c) {
                             c.point->weights = {0.5, kNan, 0.5};
                           }); },
       E::kInvalidArgument, "edits[1].add.constraint.point.weights[1]"},
      {"WeightsOfAnotherSum",
       [] { return point([](C& c) {
              c.point->weights = {0.5, 0.5, 2e-6};
            }); }, E::kInvalidArgument,
       "edits[1].add.constraint.point.weights"},
      {"NodeBelow", [] { return spoiled([](C& c) {
                           c.nodes = {1, -1};
                         }); }, E::kOutOfRange,
       "edits[1].add.constraint.nodes[1]"},
      {"NodeAbove", [] { return spoiled([](C& c) { c.nodes = {6}; }); }, E::kOutOfRange,
       "edits[1].add.constraint.nodes[0]"},
      {"NodeUnused", [] { return spoiled([](C& c) {
                            c.nodes = {2, 5};
                          }); }, E::kInvalidArgument,
       "edits[1].add.constraint.nodes[1]"},
      {"NodeTwice", [] { return spoiled([](C& c) {
                           c.nodes = {2, 1, 0, 1};
                         }); },
       E::kInvalidArgument, "edits[1].add.constraint.nodes[3]"},
      {"NoAxis", [] { return spoiled([](C& c) { c.axes = 0; }); }, E::kInvalidArgument,
       "edits[1].add.constraint.axes"},
      {"AxisUnknown", [] { return spoiled([](C& c) { c.axes = 8; }); }, E::kInvalidArgument,
       "edits[1].add.constraint.axes"},
      {"Kind", [] { return spoiled([](C& c) { c.kind = static_cast<scene::TargetKind>(9); }); },
       E::kInvalidArgument, "edits[1].add.constraint.kind"},
      {"TargetNaN", [] { return spoiled([](C& c) { c.target.y() = kNan; }); }, E::kInvalidArgument,
       "edits[1].add.constraint.target"},
      {"TargetInfinite", [] { return spoiled([](C& c) { c.target.z() = -kInfinity; }); },
       E::kInvalidArgument, "edits[1].add.constraint.target"},
      {"TargetFar", [] { return spoiled([](C& c) { c.target.z() = 1e30; }); }, E::kOutOfRange,
       "edits[1].add.constraint.target"},
      {"WeightZero", [] { return spoiled([](C& c) { c.weight = 0; }); }, E::kInvalidArgument,
       "edits[1].add.constraint.weight"},
      {"WeightNegative", [] { return spoiled([](C& c) { c.weight = -kInfinity; }); },
       E::kInvalidArgument, "edits[1].add.constraint.weight"},
      {"WeightNaN", [] { return spoiled([](C& c) { c.weight = kNan; }); }, E::kInvalidArgument,
       "edits[1].add.constraint.weight"},
      {"WeightTiny", [] { return spoiled([](C& c) { c.weight = 1e-300; }); }, E::kOutOfRange,
       "edits[1].add.constraint.weight"},
      {"IdTaken", [] { return spoiled([](C& c) { c.id = 2; }); }, E::kAlreadyExists,
       "edits[1].add.constraint.id"},
      {"MoveUnknown",
       [] {
         return BodyEdit(MoveConstraint{9, {0, 0, 0}});
       },
       E::kNotFound, "edits[1].move.id"},
      {"MoveNaN",
       [] {
         return BodyEdit(MoveConstraint{1, {kNan, 0, 0}});
       },
       E::kInvalidArgument, "edits[1].move.target"},
      {"ReplaceUnknown", [] { return BodyEdit(ReplaceConstraint{held(1, 1)}); }, E::kNotFound,
       "edits[1].replace.constraint.id"},
      {"ReplaceFrame",
       [] {
         auto c = held(99, 1);
         c.id = 1;
         return BodyEdit(ReplaceConstraint{c});
       },
       E::kOutOfRange, "edits[1].replace.constraint.frame"},
      {"RemoveUnknown", [] { return BodyEdit(RemoveConstraint{0}); }, E::kNotFound,
       "edits[1].remove.id"},
      {"EndUnknown",
       [] {
         return BodyEdit(SetEnds{static_cast<End>(7), End::kFree});
       },
       E::kInvalidArgument, "edits[1].set_ends.first_end"},
      {"LastEndUnknown",
       [] {
         return BodyEdit(SetEnds{End::kFree, static_cast<End>(-1)});
       },
       E::kInvalidArgument, "edits[1].set_ends.last_end"},
      {"FpsZero", [] { return dynamics(0, 40, 0); }, E::kInvalidArgument,
       "edits[1].set_dynamics.frames_per_second"},
      {"FpsNaN", [] { return dynamics(kNan, 40, 0); }, E::kInvalidArgument,
       "edits[1].set_dynamics.frames_per_second"},
      {"PeriodNegative", [] { return dynamics(30, -1, 0); }, E::kInvalidArgument,
       "edits[1].set_dynamics.period_frames"},
      {"PeriodTiny", [] { return dynamics(30, 1e-200, 0); }, E::kInvalidArgument,
       "edits[1].set_dynamics.period_frames"},
      {"DampingOne", [] { return dynamics(30, 40, 1); }, E::kInvalidArgument,
       "edits[1].set_dynamics.damping_ratio"},
      {"DampingNaN", [] { return dynamics(30, 40, kNan); }, E::kInvalidArgument,
       "edits[1].set_dynamics.damping_ratio"},
      // The step that edits[0] began is closed by the first Undo and taken back by it; there is no
      // other.
      {"UndoTooOften", [] { return BodyEdit(Redo{}); }, E::kFailedPrecondition, "edits[1].redo"},
  };
  return kBad;
}

class DocumentBadEdit : public ::testing::TestWithParam<BadEdit> {};

TEST_P(DocumentBadEdit, IsNamedAndLeavesEverythingAsItWas) {
  Document document = with_two();
  edit_all(document, {MoveConstraint{1, {5, 5, 5}}});
  edit_all(document, {RemoveConstraint{2}, AddConstraint{held(6, 3)}});
  edit_all(document, {Undo{}});
  const DocumentState before = state_of(document);
  try {
    edit_all(document, {MoveConstraint{1, {9, 9, 9}}, GetParam().edit()});
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), GetParam().code);
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_STRNE(error.what(), "");
    const std::string member = error.field().substr(error.field().rfind('.') + 1);
    EXPECT_FALSE(std::string(error.what()).starts_with(member + " is ")) << error.what();
  }
  EXPECT_TRUE(state_of(document) == before);
  EXPECT_EQ(document.revision(), 3u);
  EXPECT_EQ(document.undo_count(), 1u);
  EXPECT_EQ(document.redo_count(), 1u);
  // The refused request did not eat the redo step.
  EXPECT_EQ(edit_all(document, {Redo{}}).revision, 4u);
  EXPECT_THAT(ids(document), ::testing::ElementsAre(1, 3));
}

INSTANTIATE_TEST_SUITE_P(, DocumentBadEdit, ::testing::ValuesIn(bad_edits()),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace limber::session
