// Where a live structure of beams begins.

#include "engine/session/beams/live_problem.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/engine/session/beams/scenes.h"
#include "tests/support/beam_columns.h"

namespace limber::session {
namespace {

using test::cantilever;
using test::moved;

LiveBeams::Outcome settle(LiveBeams& live, const beams::BeamModel& model) {
  return live.solve(std::make_shared<const BeamConditions>(conditions_of(model)), {},
                    [](const beams::BeamState&) {});
}

/// Clamped at both ends, which come together; pushed up.
beams::BeamModel buckled() {
  beams::BeamModel model = cantilever(12, 0);
  model.sections[0].bending_3 *= 2;
  model.motions.push_back(moved(12, -0.1, 0, 0));
  model.motions[0].rotates = {true, true, true};
  for (int i = 1; i < 12; ++i) model.temporary_loads.push_back(test::force_on(i, 0, 0, 1));
  return model;
}

TEST(LiveBeams, ASideThatIsGivenIsKept) {
  const beams::BeamModel model = buckled();
  LiveBeams drawn(model);
  ASSERT_TRUE(settle(drawn, model).reached);
  EXPECT_GT(drawn.state().positions(2, 6), 0.1);
  beams::BeamModel other = model;
  for (beams::NodalLoad& load : other.temporary_loads) load.force *= -1;
  LiveBeams below(other);
  ASSERT_TRUE(settle(below, other).reached);
  ASSERT_LT(below.state().positions(2, 6), -0.1);
  LiveBeams again(model, below.state());
  const LiveBeams::Outcome outcome = settle(again, model);
  EXPECT_TRUE(outcome.reached) << outcome.report.message;
  EXPECT_LT((again.state().positions - below.state().positions).norm(), 1e-9);
}

TEST(LiveBeams, ShapesThatNobodyCanComeBackToAreDropped) {
  beams::BeamModel model = cantilever(4, 0);
  model.loads.push_back(test::force_on(4, 0, 0, 1));
  LiveBeams live(model);
  std::vector<std::weak_ptr<const BeamConditions>> dropped;
  const auto kept = std::make_shared<const BeamConditions>(conditions_of(model));
  ASSERT_TRUE(live.solve(kept, {}, [](const beams::BeamState&) {}).reached);
  const Eigen::Matrix3Xd shape = live.state().positions;
  for (const double force : {1.1, 1.2, 1.3, 1.4}) {
    model.loads.back() = test::force_on(4, 0, 0, force);
    const auto conditions = std::make_shared<const BeamConditions>(conditions_of(model));
    ASSERT_TRUE(live.solve(conditions, {}, [](const beams::BeamState&) {}).reached);
    dropped.emplace_back(conditions);
  }
  for (std::size_t i = 0; i + 1 < dropped.size(); ++i) EXPECT_TRUE(dropped[i].expired()) << i;
  const LiveBeams::Outcome again = live.solve(kept, {}, [](const beams::BeamState&) {});
  EXPECT_TRUE(again.reached);
  EXPECT_EQ(live.state().positions, shape) << "undo comes back to it";
}

/// Clamped and pinned, pressed along its axis after it was at rest without a load.
TEST(LiveBeams, AStraightColumnBeyondItsLoadBucklesOrIsReportedAsUnstable) {
  beams::BeamModel model = cantilever(8, 0);
  model.sections[0].bending_3 *= 4;
  model.supports.push_back({8, {false, true, true, false, false, false}});
  const double euler = 20.1907;  // EI / L^2 = 1 N
  LiveBeams live(model);
  ASSERT_TRUE(settle(live, model).reached);
  model.loads.push_back(test::force_on(8, -0.9 * euler));
  const LiveBeams::Outcome below = settle(live, model);
  ASSERT_TRUE(below.reached) << below.report.message;
  EXPECT_EQ(below.report.negative_eigenvalues, 0);
  EXPECT_LT(live.state().positions.row(2).cwiseAbs().maxCoeff(), 1e-6);
  for (const double times : {1.2, 2.0, 5.0}) {
    model.loads.back() = test::force_on(8, -times * euler);
    const LiveBeams::Outcome outcome = settle(live, model);
    if (outcome.reached) {
      EXPECT_GT(live.state().positions.row(2).cwiseAbs().maxCoeff(), 0.05) << times;
      EXPECT_EQ(outcome.report.negative_eigenvalues, 0) << times;
    } else {
      EXPECT_NE(outcome.report.status, beams::BeamStatus::kConverged) << times;
    }
    // Twice the load leaves the branch of the first mode in one piece.
    EXPECT_TRUE(outcome.reached || times > 2) << times << ": " << outcome.report.message;
  }
}

/// All ends, alone and beside a softer body: from the unloaded column to below its load and beyond.
TEST(LiveBeams, NoStraightColumnBeyondItsLoadIsReportedAsEquilibrium) {
  using namespace limber::testing;
  for (const Beside beside : {Beside::kNothing, Beside::kSoftCantilever}) {
    for (const ColumnEnds ends :
         {ColumnEnds::kPinnedPinned, ColumnEnds::kClampedFree, ColumnEnds::kClampedPinned,
          ColumnEnds::kClampedGuided, ColumnEnds::kClampedClamped}) {
      SCOPED_TRACE(limber::testing::to_string(ends));
      Column column{ends, 8, 0, beside};
      LiveBeams live(column_model(column));
      ASSERT_TRUE(settle(live, column_model(column)).reached);
      int reached = 0;
      for (const double load : {0.9, 1.02, 1.2, 1.5, 3.0}) {
        column.load = load;
        const beams::BeamModel model = column_model(column);
        const beams::BeamStructure structure(model);
        const LiveBeams::Outcome outcome = settle(live, model);
        if (!outcome.reached) {
          EXPECT_GT(load, 1.5) << outcome.report.message;
          EXPECT_EQ(outcome.report.message.rfind("Stopped at ", 0), 0U) << outcome.report.message;
          EXPECT_LT(outcome.report.load_factor, 1);
          continue;
        }
        ++reached;
        EXPECT_EQ(outcome.report.negative_eigenvalues, 0) << load;
        EXPECT_EQ(negative_by_differences(structure, live.state()), 0) << load;
        const bool is_stable = negative_by_differences(structure, straight_state(column)) == 0;
        // Turned over, hanging from its other end, it may be straight.
        const bool is_straight = deflection(column, live.state()) < 1e-6 &&
                                 live.state().positions(2, column.elements) > 0;
        EXPECT_EQ(is_straight, is_stable) << load;
      }
      EXPECT_GE(reached, 4);
    }
  }
}

/// Clamped, its nodes moving along it only: nothing but the force in its elements tells that they
/// buckle, twice their load at a push of 0.0493 m.
TEST(LiveBeams, AnEditThatElementsDoNotResolveStopsAtTheShareUpToWhichTheyDo) {
  beams::BeamModel model = cantilever(5, 0);
  model.sections[0].stretching = 40000 * model.sections[0].bending_2;
  for (int i = 1; i < 5; ++i) model.supports.push_back({i, {false, true, true, true, true, true}});
  model.supports.push_back({5, {false, true, true, true, true, true}});
  model.motions = {moved(5, 0, {}, {})};
  LiveBeams live(model);
  ASSERT_TRUE(settle(live, model).reached);
  model.motions = {moved(5, -0.1, {}, {})};
  const LiveBeams::Outcome outcome = settle(live, model);
  EXPECT_FALSE(outcome.reached);
  EXPECT_NEAR(outcome.report.load_factor, 0.493, 0.01);
  EXPECT_EQ(outcome.report.message.rfind("Stopped at 49", 0), 0U) << outcome.report.message;
  EXPECT_NE(outcome.report.message.find("balanced at 100 %, but element"), std::string::npos)
      << outcome.report.message;
  // Up to there it is reached, with a note; from there nothing of a further push is.
  model.motions = {moved(5, -0.0492, {}, {})};
  const LiveBeams::Outcome below = settle(live, model);
  ASSERT_TRUE(below.reached) << below.report.message;
  EXPECT_NE(below.report.message.find("at which it buckles by itself"), std::string::npos)
      << below.report.message;
  model.motions = {moved(5, -0.5, {}, {})};
  const LiveBeams::Outcome beyond = settle(live, model);
  EXPECT_FALSE(beyond.reached);
  EXPECT_LT(beyond.report.load_factor, 0.002);
}

/// A released support leaves a mechanism from the first step on: a straight beam that rolls.
TEST(LiveBeams, AnEditWithoutAnyEquilibriumStopsAtNothingAndSaysWhy) {
  beams::BeamModel model = cantilever(6, 0);
  LiveBeams live(model);
  ASSERT_TRUE(settle(live, model).reached);
  const beams::BeamState before = live.state();
  model.supports[0].fixed[3] = false;
  const LiveBeams::Outcome outcome = settle(live, model);
  EXPECT_FALSE(outcome.reached);
  EXPECT_EQ(outcome.report.load_factor, 0);
  EXPECT_EQ(outcome.report.message.rfind("Stopped at 0 % of the requested change: ", 0), 0U)
      << outcome.report.message;
  for (const char* what :
       {"without any resistance", "the shape before this change is the last equilibrium"})
    EXPECT_NE(outcome.report.message.find(what), std::string::npos) << outcome.report.message;
  EXPECT_EQ((live.state().positions - before.positions).norm(), 0);
}

TEST(LiveBeams, AShapeOutOfBalanceIsFollowedToOneInBalance) {
  const beams::BeamModel model = cantilever(20, 1);
  LiveBeams live(model, beams::BeamStructure(model).rest_state());
  const LiveBeams::Outcome outcome = settle(live, model);
  EXPECT_TRUE(outcome.reached) << outcome.report.message;
  EXPECT_NEAR(live.state().positions(2, 20), -0.30172, 1e-4);
}

/// Where nothing is held so, there is no equilibrium from anywhere, and the report says it of the
/// structure as drawn.
TEST(LiveBeams, AShapeThatLeadsNowhereIsLeftForTheStructureAsDrawn) {
  beams::BeamModel model = cantilever(6, 0);
  model.supports[0].fixed[3] = false;  // it turns about itself
  LiveBeams live(model, beams::BeamStructure(model).rest_state());
  const LiveBeams::Outcome outcome = settle(live, model);
  EXPECT_FALSE(outcome.reached);
  EXPECT_NE(outcome.report.message.find("as drawn"), std::string::npos) << outcome.report.message;
}

/// Cancelled along the path or before it, what it began from is not forgotten.
TEST(LiveBeams, AShapeThatASolveWasCancelledAtIsStillBegunFrom) {
  const beams::BeamModel model = buckled();
  beams::BeamModel other = model;
  for (beams::NodalLoad& load : other.temporary_loads) load.force *= -1;
  LiveBeams below(other);
  ASSERT_TRUE(settle(below, other).reached);
  beams::BeamModel closer = model;
  closer.motions[0].translation.x() = -0.15;
  for (const bool restores : {true, false}) {
    LiveBeams live(closer, below.state());
    for (const int after : {0, 2}) {
      JobContext job;
      int shapes = 0;
      if (after == 0) job.cancellation.request();
      const LiveBeams::Outcome stopped =
          live.solve(std::make_shared<const BeamConditions>(conditions_of(closer)), job,
                     [&](const beams::BeamState&) {
                       if (++shapes == after) job.cancellation.request();
                     });
      EXPECT_EQ(stopped.report.status, beams::BeamStatus::kCancelled);
      if (restores) live.restore();
      EXPECT_LT(live.state().positions(2, 6), -0.1);
    }
    const LiveBeams::Outcome outcome = settle(live, closer);
    EXPECT_TRUE(outcome.reached) << outcome.report.message;
    EXPECT_LT(live.state().positions(2, 6), -0.15) << "the temporary loads push up";
  }
}

/// Far from any balance, and where no number is one any more.
TEST(LiveBeams, AShapeThatNumbersDoNotHoldIsLeftForTheStructureAsDrawn) {
  const beams::BeamModel model = buckled();
  for (const double z : {0.0, 1e200}) {
    beams::BeamState shape = beams::BeamStructure(model).rest_state();
    shape.positions.setZero();
    shape.positions(2, 3) = z;
    LiveBeams live(model, shape);
    const LiveBeams::Outcome outcome = settle(live, model);
    EXPECT_TRUE(outcome.reached) << outcome.report.message;
    EXPECT_GT(live.state().positions(2, 6), 0.1);
    EXPECT_NE(outcome.report.message.find("as drawn"), std::string::npos) << outcome.report.message;
  }
}

TEST(LiveBeams, AShapeOfAnotherStructureIsRefused) {
  const beams::BeamState other = beams::BeamStructure(cantilever(5, 1)).rest_state();
  try {
    const LiveBeams live(cantilever(6, 1), other);
    FAIL() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "shape");
  }
}

}  // namespace
}  // namespace limber::session
