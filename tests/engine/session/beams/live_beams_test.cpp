// Where a live structure of beams begins.

#include "engine/session/beams/live_beams.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "tests/engine/session/beams/beam_scenes.h"

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

/// Clamped and pinned, pressed along its axis after it was at rest without a load.
TEST(LiveBeams, AStraightColumnBeyondItsLoadBucklesOrIsSaidToBeUnstable) {
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
  beams::BeamModel model = cantilever(6, 1);
  model.supports[0].fixed[3] = false;  // it turns about itself
  LiveBeams live(model, beams::BeamStructure(model).rest_state());
  const LiveBeams::Outcome outcome = settle(live, model);
  EXPECT_FALSE(outcome.reached);
  EXPECT_NE(outcome.report.message.find("as drawn"), std::string::npos) << outcome.report.message;
}

/// Cancelled on the way or before it, what it began from is not forgotten.
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
