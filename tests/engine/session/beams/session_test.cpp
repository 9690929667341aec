// A structure of beams that is held in equilibrium while it is edited.

#include "engine/session/beams/session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>

#include "engine/base/error.h"
#include "engine/beams/solver/equilibrium.h"
#include "tests/engine/session/beams/scenes.h"
#include "tests/engine/session/bodies/harness.h"

namespace limber::session {
namespace {

using beams::BeamStatus;
using Shared = std::shared_ptr<const BeamResult>;

class BeamRecorder : public BeamListener {
 public:
  void on_state(State state, const std::string&) override {
    const std::lock_guard lock(mutex_);
    states_.push_back(state);
    changed_.notify_all();
  }
  /// From within the task, at the first intermediate shape.
  void on_intermediate(std::function<void()> what) {
    const std::lock_guard lock(mutex_);
    on_intermediate_ = std::move(what);
  }
  void on_result(const Shared& result) override {
    std::function<void()> what;
    {
      const std::lock_guard lock(mutex_);
      if (!result->is_final) what = std::exchange(on_intermediate_, nullptr);
    }
    if (what) what();
    const std::lock_guard lock(mutex_);
    gap_ = gap_ || result->sequence != results_.size() + 1;
    results_.push_back(result);
    changed_.notify_all();
  }

  Shared wait_final(Revision revision) {
    std::unique_lock lock(mutex_);
    Shared found;
    changed_.wait_for(lock, std::chrono::seconds(60), [&] {
      for (const auto& result : results_)
        if (result->is_final && result->revision >= revision) found = result;
      return found != nullptr;
    });
    return found;
  }
  [[nodiscard]] std::vector<Shared> results() const {
    const std::lock_guard lock(mutex_);
    return results_;
  }
  [[nodiscard]] std::vector<State> states() const {
    const std::lock_guard lock(mutex_);
    return states_;
  }
  [[nodiscard]] bool has_gap() const {
    const std::lock_guard lock(mutex_);
    return gap_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Shared> results_;
  std::vector<State> states_;
  bool gap_ = false;
  std::function<void()> on_intermediate_;
};

struct LiveBeamSession {
  explicit LiveBeamSession(beams::BeamModel model)
      : session("live", std::move(model), {}, pool.executor(), recorder) {}
  std::shared_ptr<BeamRecorder> recorder = std::make_shared<BeamRecorder>();
  test::Pool pool{1};
  BeamSession session;

  Shared edit(const std::vector<BeamEdit>& edits) {
    return recorder->wait_final(session.edit(edits).revision);
  }
};

Eigen::Vector3d node_at(const BeamResult& result, int node) {
  return result.frames->rightCols<1>().segment<3>(7 * node);
}

/// Distance of the farthest node from where a solve from the drawn structure has it.
double from_fresh(const BeamSession& session, const BeamResult& result) {
  const beams::BeamSolution fresh = find_equilibrium(beams::BeamStructure(session.model()));
  EXPECT_TRUE(fresh.report.converged()) << fresh.report.message;
  return (fresh.state.positions - result.analysis->solution.state.positions)
      .colwise()
      .norm()
      .maxCoeff();
}

TEST(BeamSession, OpensInEquilibriumAndSettlesAfterEveryEdit) {
  LiveBeamSession live(test::cantilever(20, 1));
  const Shared opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  EXPECT_TRUE(opened->report.converged()) << opened->report.message;
  EXPECT_EQ(opened->frames->rows(), 7 * 21);
  EXPECT_NEAR(node_at(*opened, 20).z(), -0.30172, 1e-4);

  const Shared loaded = live.edit({SetNodeLoad{test::force_on(20, 0, 0, -10)}});
  ASSERT_TRUE(loaded && loaded->report.converged()) << loaded->report.message;
  EXPECT_NEAR(node_at(*loaded, 20).z(), -0.81061, 1e-4);
  EXPECT_NEAR(loaded->analysis->results.reaction_forces(2, 0), 10, 1e-5);
  // Frames are load steps from where it was, never from nothing.
  ASSERT_GE(loaded->frames->cols(), 3);
  double height = -0.3017;
  for (const auto& frame : loaded->frames->colwise()) {
    EXPECT_LT(frame[7 * 20 + 2], height);
    height = frame[7 * 20 + 2];
  }
  EXPECT_LT(from_fresh(live.session, *loaded), 1e-6);

  const Shared moved = live.edit({MoveNode{test::moved(0, {}, {}, 0.5)}});
  ASSERT_TRUE(moved && moved->report.converged()) << moved->report.message;
  EXPECT_NEAR(node_at(*moved, 20).z(), 0.5 - 0.81061, 1e-4) << "all of it goes with its support";
  const Shared turned = live.edit({MoveNode{test::turned(0, {0, 0.4, 0})}});
  ASSERT_TRUE(turned && turned->report.converged()) << turned->report.message;
  EXPECT_LT(from_fresh(live.session, *turned), 1e-5);
  EXPECT_FALSE(live.recorder->has_gap());
  EXPECT_EQ(live.recorder->states(), std::vector{State::kReady});
}

TEST(BeamSession, AManyEditedArchEndsWhereAFreshOneDoes) {
  LiveBeamSession live(test::shallow_arch(2));
  live.edit({MoveNode{test::moved(16, -0.05, {}, {})}});
  live.edit({SetGravity{{0, 0, -9.81}}, SetElementLoad{{3, {0, 0.5, -4}}}});
  live.edit({SetNodeLoad{{5, {1, 2, 0}, {0, 0.05, 0}}}});
  live.edit({SetSupport{test::held(0)}, Undo{}});
  const Shared last = live.edit({MoveNode{test::moved(16, -0.12, 0.05, {})}});
  ASSERT_TRUE(last && last->report.converged()) << last->report.message;
  EXPECT_LT(from_fresh(live.session, *last), 1e-5);
}

TEST(BeamSession, ASnapIsReportedAndUndoReturnsBeforeIt) {
  LiveBeamSession live(test::shallow_arch(5));
  const Shared opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  const Shared snapped = live.edit({SetNodeLoad{test::force_on(8, 0, 0, -20)}});
  ASSERT_TRUE(snapped && snapped->report.converged()) << snapped->report.message;
  ASSERT_EQ(snapped->report.snaps.size(), 1U);
  EXPECT_LT(node_at(*snapped, 8).z(), -0.03);
  const Shared back = live.edit({Undo{}});
  ASSERT_TRUE(back && back->report.converged());
  EXPECT_TRUE(back->report.snaps.empty()) << "undo goes back to the shape, not along the path";
  EXPECT_LT((node_at(*back, 8) - node_at(*opened, 8)).norm(), 1e-6);
}

TEST(BeamSession, NodesAreReleasedAndHeldWhereTheyAre) {
  LiveBeamSession live(test::cantilever(12, 4));
  ASSERT_TRUE(live.recorder->wait_final(0));
  const Shared held = live.edit({HoldNode{12}});
  ASSERT_TRUE(held && held->report.converged()) << held->report.message;
  const Eigen::Vector3d tip = node_at(*held, 12);
  EXPECT_LT(tip.z(), -0.5);
  // Without its load it would go back, but for what holds it.
  const Shared unloaded = live.edit({SetNodeLoad{test::force_on(12)}});
  ASSERT_TRUE(unloaded && unloaded->report.converged()) << unloaded->report.message;
  EXPECT_LT((node_at(*unloaded, 12) - tip).norm(), 1e-6);
  EXPECT_GT(unloaded->analysis->results.reaction_forces.col(12).norm(), 3.5);
  const Shared free = live.edit({ReleaseNode{12}});
  ASSERT_TRUE(free && free->report.converged()) << free->report.message;
  EXPECT_LT(free->analysis->solution.state.positions.row(2).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(BeamSession, WhatHasNoEquilibriumLeavesTheLastOne) {
  LiveBeamSession live(test::cantilever(6, 1));
  const Shared opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  beams::BeamSupport hinge = test::held(0);
  hinge.fixed = {true, true, true, true, false, true};
  const Shared loose = live.edit({SetSupport{hinge}, SetNodeLoad{test::force_on(6)}});
  ASSERT_TRUE(loose);
  EXPECT_TRUE(loose->is_final) << "final";
  EXPECT_TRUE(loose->solve_failed);
  EXPECT_EQ(loose->report.status, BeamStatus::kMechanism);
  EXPECT_NE(loose->report.message.find("node"), std::string::npos) << loose->report.message;
  EXPECT_EQ(*loose->frames, opened->frames->rightCols<1>());
  EXPECT_EQ(loose->analysis, opened->analysis);
  // The edit is kept; a better one continues from the last good shape.
  const Shared good = live.edit({SetSupport{test::held(0)}});
  ASSERT_TRUE(good);
  EXPECT_FALSE(good->solve_failed);
  EXPECT_LT(from_fresh(live.session, *good), 1e-6);
}

TEST(BeamSession, RefusedEditsChangeNothing) {
  LiveBeamSession live(test::cantilever(4, 1));
  ASSERT_TRUE(live.recorder->wait_final(0));
  EXPECT_THROW(live.session.edit({ReleaseNode{0}}), Error);
  EXPECT_THROW(live.session.edit({SetNodeLoad{test::force_on(9, 0, 0, 1)}}), Error);
  EXPECT_EQ(live.session.revision(), 0U);
  // The amendment of the result as opened may come at any time.
  for (const Shared& result : live.recorder->results()) EXPECT_EQ(result->revision, 0U);
  EXPECT_THROW(BeamSession("x", beams::BeamModel{}, {}, live.pool.executor(), nullptr), Error);
}

TEST(BeamSession, ANewerEditInterruptsAndContinuesFromThePath) {
  LiveBeamSession live(test::cantilever(60, 1));
  ASSERT_TRUE(live.recorder->wait_final(0));
  // The second one comes while the first, a long path, is followed.
  std::atomic<Revision> last = 0;
  live.recorder->on_intermediate(
      [&] { last = live.session.edit({SetNodeLoad{test::force_on(60, 0, 0, -2)}}).revision; });
  live.session.edit({MoveNode{test::turned(0, {0, -9, 0})}});
  const Shared settled = live.recorder->wait_final(2);
  ASSERT_TRUE(settled);
  EXPECT_EQ(last, 2U) << "it had to come during the solve";
  EXPECT_TRUE(settled->report.converged()) << settled->report.message;
  EXPECT_EQ(settled->revision, 2U);
  for (const Shared& result : live.recorder->results())
    EXPECT_FALSE(result->is_final && result->revision == 1) << "the first was superseded";
  // The support has turned by 9 rad, not by what is left of whole turns.
  EXPECT_LT(from_fresh(live.session, *settled), 1e-5);
}

TEST(BeamSession, CancelledItIsWhereItWasAndCanContinue) {
  LiveBeamSession live(test::cantilever(60, 1));
  const Shared opened = live.recorder->wait_final(0);
  ASSERT_TRUE(opened);
  live.recorder->on_intermediate([&] { live.session.cancel(); });
  const Shared cancelled = live.edit({MoveNode{test::turned(0, {0, -6, 0})}});
  ASSERT_TRUE(cancelled);
  EXPECT_EQ(cancelled->report.status, BeamStatus::kCancelled);
  EXPECT_FALSE(cancelled->solve_failed);
  EXPECT_EQ(*cancelled->frames, opened->frames->rightCols<1>());
  const Shared after = live.edit({MoveNode{test::turned(0, {0, -0.5, 0})}});
  ASSERT_TRUE(after && after->report.converged()) << after->report.message;
  EXPECT_LT(from_fresh(live.session, *after), 1e-5);
}

TEST(BeamSession, APushChoosesTheSideAndIsGone) {
  // Straight, pressed by a tenth: up or down is all the same to it.
  for (const double side : {1.0, -1.0}) {
    beams::BeamModel model = test::cantilever(12, 0);
    model.supports[0].fixed = {true, true, true, true, false, true};
    beams::BeamSupport end = model.supports[0];
    end.node = 12;
    model.supports.push_back(end);
    LiveBeamSession live(std::move(model));
    ASSERT_TRUE(live.recorder->wait_final(0));
    live.session.edit(
        {PushNode{test::force_on(6, 0, 0, side)}, MoveNode{test::moved(12, -0.1, {}, {})}});
    // Not interrupted by what comes at once.
    const Shared bent = live.edit({SetGravity{{0, 0, -1e-9}}});
    ASSERT_TRUE(bent && bent->report.converged()) << bent->report.message;
    EXPECT_GT(side * node_at(*bent, 6).z(), 0.15);
    EXPECT_LT(bent->analysis->results.reaction_forces.row(2).cwiseAbs().maxCoeff(), 1e-3);
  }
}

/// Straight, wide, clamped and pressed by a tenth; its own temporary loads push it down.
beams::BeamModel pressed_and_pushed() {
  beams::BeamModel model = test::cantilever(12, 0);
  // Equally stiff sideways, it would roll over to where loads that stay push it.
  model.sections[0].bending_3 *= 2;
  beams::BeamSupport end = test::held(12);
  end.fixed[0] = false;
  model.supports.push_back(end);
  model.motions.push_back(test::moved(12, -0.1, {}, {}));
  for (int i = 1; i < 12; ++i) model.temporary_loads.push_back(test::force_on(i, 0, 0, -1));
  return model;
}

TEST(BeamSession, TheStructuresTemporaryLoadsChooseTheSideAfterACancelledOpeningToo) {
  for (const bool waits : {true, false}) {
    LiveBeamSession live(pressed_and_pushed());
    live.session.cancel();
    if (waits) {
      const Shared opened = live.recorder->wait_final(0);
      ASSERT_TRUE(opened);
    }
    // More up than down: loads that act in the end do not choose where nothing has been chosen.
    const Shared edited = live.edit({SetNodeLoad{test::force_on(3, 0, 0, 1e-3)}});
    ASSERT_TRUE(edited && edited->report.converged()) << edited->report.message;
    EXPECT_LT(node_at(*edited, 6).z(), -0.15) << waits;
  }
}

TEST(BeamSession, ItsStructureKeepsTheTemporaryLoadsThatItCameWith) {
  LiveBeamSession live(pressed_and_pushed());
  ASSERT_TRUE(live.recorder->wait_final(0));
  EXPECT_EQ(live.session.model().temporary_loads.size(), 11U);
  EXPECT_TRUE(live.session.conditions()->temporary_loads.empty());
  const Shared edited = live.edit({SetNodeLoad{test::force_on(3, 0, 0, 1e-3)}});
  ASSERT_TRUE(edited && edited->report.converged()) << edited->report.message;
  EXPECT_EQ(live.session.model().temporary_loads.size(), 11U);
  EXPECT_LT(from_fresh(live.session, *edited), 1e-5);
  // Once it is in balance they act no more: it goes where it is pushed.
  const Shared pushed =
      live.edit({SetNodeLoad{test::force_on(6)}, MoveNode{test::moved(12, 0.0, {}, {})}});
  ASSERT_TRUE(pushed && pushed->report.converged()) << pushed->report.message;
  const Shared up =
      live.edit({PushNode{test::force_on(6, 0, 0, 1)}, MoveNode{test::moved(12, -0.1, {}, {})}});
  ASSERT_TRUE(up && up->report.converged()) << up->report.message;
  EXPECT_GT(node_at(*up, 6).z(), 0.15);
}

TEST(BeamSession, ClosedItSaysSoAndRefuses) {
  LiveBeamSession live(test::cantilever(40, 1));
  live.session.close();
  EXPECT_EQ(live.session.state(), State::kClosed);
  EXPECT_EQ(live.recorder->states().back(), State::kClosed);
  EXPECT_THROW(live.session.edit({Undo{}}), Error);
}

}  // namespace
}  // namespace limber::session
