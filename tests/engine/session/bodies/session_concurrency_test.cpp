#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>

#include "engine/session/bodies/session.h"
#include "tests/engine/session/bodies/harness.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::bar_node;
using test::held;
using test::Pool;
using test::Recorder;

constexpr int kSmallCells = 4;
const int kSmallTip = bar_node(kSmallCells, kSmallCells, 1, 2);

scene::Scene small_bar(int frames = 24) {
  scene::Scene scene = test::bar(kSmallCells, frames);
  scene.model.mode_count = 6;
  scene.model.basis_size = 12;
  scene.model.cubature_size = 6;
  scene.constraints = {held(8, kSmallTip, {0, 0.05, 0.02}), held(16, kSmallTip, {0, -0.05, 0})};
  return scene;
}

/// A recorder whose hooks can reach the session, which does not exist yet when the first call may
/// come.
struct Hooked {
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  std::promise<BodySession*> promise;
  std::shared_future<BodySession*> session = promise.get_future().share();
};

TEST(SessionConcurrency, AStormOfEditsIsCoalescedAndNoneIsLost) {
  Pool pool(2);
  const auto recorder = std::make_shared<Recorder>();
  BodySession session("storm", small_bar(), {}, test::shared_cache(), pool.executor(), recorder);
  std::atomic<int> accepted = 0;
  std::vector<std::thread> editors;
  for (int t = 0; t < 3; ++t) {
    editors.emplace_back([&, t] {
      Random random(static_cast<std::uint64_t>(100 + t));
      std::uint64_t own = 0;
      for (int i = 0; i < 300; ++i) {
        const Eigen::Vector3d target(0, random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06));
        try {
          switch (test::below(random, 12)) {
            case 0:
              if (own == 0)
                own = session.edit({AddConstraint{held(4 + 5 * t, kSmallTip - 1, target)}})
                          .constraint_ids[0];
              else
                session.edit({RemoveConstraint{std::exchange(own, 0)}});
              break;
            case 1:
              session.edit({Undo{}});
              break;
            case 2:
              session.edit({SetDynamics{{30, random.uniform(15, 30), 0.01}}});
              break;
            default:
              session.edit(
                  {MoveConstraint{1u + static_cast<unsigned>(test::below(random, 2)), target}});
          }
          ++accepted;
        } catch (const Error& error) {
          // Undo of another thread took the constraint away, or there was nothing to undo.
          ASSERT_TRUE(error.code() == ErrorCode::kNotFound ||
                      error.code() == ErrorCode::kFailedPrecondition);
        }
        if (i % 16 == 0) std::this_thread::yield();
      }
    });
  }
  std::thread reader([&] {
    for (int i = 0; i < 200; ++i) {
      (void)session.scene();
      (void)session.state_message();
      (void)session.progress();
      if (const auto result = session.newest_result()) (void)session.positions(*result, 0, 2);
      std::this_thread::yield();
    }
  });
  for (std::thread& editor : editors) editor.join();
  reader.join();
  EXPECT_EQ(session.revision(), static_cast<Revision>(accepted));
  const auto final = recorder->wait_final(session.revision());
  ASSERT_TRUE(final);
  EXPECT_EQ(recorder->fault(), "");
  EXPECT_EQ(final->revision, session.revision());
  EXPECT_EQ(final->report.status, SolveStatus::kConverged) << final->report.message;
  const auto fresh = test::solve_fresh(session.scene(), test::shared_cache());
  EXPECT_NEAR(final->report.total_energy, fresh->report.total_energy,
              1e-6 * fresh->report.total_energy + 1e-12);
}

TEST(SessionConcurrency, CancelDuringTheBuildThenTryAgain) {
  Hooked hooked;
  std::atomic<bool> once = true;
  hooked.recorder->progress_hook = [&](const Progress&) {
    if (once.exchange(false)) hooked.session.get()->cancel();
  };
  Pool pool(1);
  BodySession session("cancelled", small_bar(), {}, nullptr, pool.executor(), hooked.recorder);
  hooked.promise.set_value(&session);
  ASSERT_TRUE(hooked.recorder->wait_state(State::kFailed));
  EXPECT_EQ(session.state(), State::kFailed);
  EXPECT_THAT(session.state_message(), ::testing::HasSubstr("cancelled"));
  EXPECT_FALSE(session.newest_result());
  EXPECT_FALSE(session.model());
  EXPECT_THROW(session.edit({RemoveConstraint{1}}), Error);
  EXPECT_EQ(session.revision(), 0u);
  session.solve_cold();
  EXPECT_TRUE(hooked.recorder->wait_final(0));
  EXPECT_EQ(session.state(), State::kReady);
  EXPECT_EQ(session.state_message(),
            session.model()->report.met_tolerance ? "" : session.model()->report.message);
}

TEST(SessionConcurrency, AResultSaysWhichColdRequestItContains) {
  Hooked hooked;
  std::atomic<bool> once = true;
  hooked.recorder->hook = [&](const BodyResult& result) {
    if (result.is_final && once.exchange(false)) hooked.session.get()->solve_cold(7);
  };
  Pool pool(1);
  BodySession session("cold", small_bar(), {}, test::shared_cache(), pool.executor(),
                      hooked.recorder);
  hooked.promise.set_value(&session);
  ASSERT_TRUE(hooked.recorder->wait_final(0));
  const auto edited = session.edit({RemoveConstraint{1}}).revision;
  ASSERT_TRUE(hooked.recorder->wait_final(edited));
  bool asked = false;
  for (const auto& result : hooked.recorder->results()) {
    EXPECT_EQ(result->cold_request, asked ? 7u : 0u) << result->sequence;
    asked = asked || result->is_final;  // final when the request came; all that follow have it
  }
}

TEST(SessionConcurrency, CancelDuringTheSolveKeepsTheNewestResult) {
  Hooked hooked;
  std::atomic<bool> once = true;
  hooked.recorder->hook = [&](const BodyResult& result) {
    if (result.revision == 1 && !result.is_final && once.exchange(false))
      hooked.session.get()->cancel();
  };
  Pool pool(1);
  BodySession session("cancelled", small_bar(), {}, test::shared_cache(), pool.executor(),
                      hooked.recorder);
  hooked.promise.set_value(&session);
  ASSERT_TRUE(hooked.recorder->wait_final(0));
  // Far enough away that the first corrected motion is not the optimum.
  session.edit({MoveConstraint{1, {-0.1, 0.3, 0.1}}});
  const auto cancelled = hooked.recorder->wait_final(1);
  ASSERT_TRUE(cancelled);
  EXPECT_EQ(cancelled->report.status, SolveStatus::kCancelled);
  EXPECT_EQ(session.state(), State::kReady);
  EXPECT_EQ(session.newest_result()->coordinates, cancelled->coordinates);
  EXPECT_EQ(session.newest_result()->report.status, SolveStatus::kCancelled);
  session.cancel();  // nothing runs: nothing happens to what comes later
  session.edit({MoveConstraint{2, {0, 0.01, 0}}});
  EXPECT_EQ(hooked.recorder->wait_final(2)->report.status, SolveStatus::kConverged);
}

TEST(SessionConcurrency, ACancelledColdSolveLeavesTheAnswerThatWasThere) {
  Hooked hooked;
  std::atomic<bool> armed = false;
  hooked.recorder->hook = [&](const BodyResult& result) {
    if (!result.is_final && armed.exchange(false)) hooked.session.get()->cancel();
  };
  Pool pool(1);
  BodySession session("cold", small_bar(), {}, test::shared_cache(), pool.executor(),
                      hooked.recorder);
  hooked.promise.set_value(&session);
  session.edit({MoveConstraint{1, {-0.1, 0.3, 0.1}}});
  const auto solved = hooked.recorder->wait_final(1);
  ASSERT_TRUE(solved);
  ASSERT_EQ(solved->report.status, SolveStatus::kConverged);
  armed = true;
  session.solve_cold(7);
  const auto kept = hooked.recorder->wait_final(1, solved->sequence);
  ASSERT_TRUE(kept);
  const auto between = hooked.recorder->next_solved(solved->sequence);
  EXPECT_GT(between->report.total_energy, 1.01 * solved->report.total_energy) << "the cold motion";
  EXPECT_EQ(kept->coordinates, session.newest_result()->coordinates);
  EXPECT_EQ(kept->report.status, SolveStatus::kConverged);
  EXPECT_EQ(kept->report.total_energy, solved->report.total_energy);
  EXPECT_EQ(kept->coordinates, solved->coordinates);
  EXPECT_EQ(kept->cold_request, 7u);
  // The solver continues from there, not from where the cold solve was.
  session.edit({MoveConstraint{1, {-0.1, 0.3, 0.1001}}});
  const auto next = hooked.recorder->wait_final(2);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->report.status, SolveStatus::kConverged);
  const auto corrected = hooked.recorder->next_solved(kept->sequence);
  EXPECT_LT((corrected->coordinates - solved->coordinates).norm(),
            0.01F * solved->coordinates.norm());
  EXPECT_EQ(hooked.recorder->fault(), "");
}

/// A session whose tasks run when the test says so.
struct Queued {
  std::vector<std::function<void()>> tasks;
  BodySession session{"queued",
                      small_bar(),
                      {},
                      test::shared_cache(),
                      [this](std::function<void()> task) { tasks.push_back(std::move(task)); },
                      std::make_shared<Recorder>()};

  /// The session's task, the check that it begins, and so on until nothing is left.
  void run() {
    ASSERT_EQ(tasks.size(), 1u);
    while (!tasks.empty()) {
      for (const auto& task : std::exchange(tasks, {})) task();
    }
  }
};

TEST(SessionConcurrency, AColdSolveCancelledBeforeItBeginsPublishesNothing) {
  Queued queued;
  BodySession& session = queued.session;
  const auto run = [&] { queued.run(); };
  run();
  const auto solved = session.newest_result();
  ASSERT_EQ(solved->report.status, SolveStatus::kConverged);
  session.solve_cold();
  session.cancel();
  run();
  EXPECT_EQ(session.newest_result(), solved);
}

TEST(SessionConcurrency, CancelledEditsAreStillInTheState) {
  Queued queued;
  BodySession& session = queued.session;
  const auto run = [&] { queued.run(); };
  run();
  const double opened = session.newest_result()->report.total_energy;
  session.edit({MoveConstraint{1, {0, 0.08, 0}}});
  session.cancel();
  run();
  const auto skipped = session.newest_result();
  EXPECT_EQ(skipped->revision, 1u);
  EXPECT_TRUE(skipped->is_final);
  EXPECT_EQ(skipped->report.status, SolveStatus::kCancelled);
  EXPECT_NE(skipped->report.total_energy, opened);
  session.solve_cold();
  run();
  EXPECT_EQ(session.newest_result()->report.status, SolveStatus::kConverged);
  EXPECT_LE(session.newest_result()->report.total_energy,
            skipped->report.total_energy * (1 + 1e-9));
}

TEST(SessionConcurrency, CloseWhileRunning) {
  for (int round = 0; round < 10; ++round) {
    Pool pool(1);
    const auto recorder = std::make_shared<Recorder>();
    BodySession session("closing", small_bar(), {}, round < 5 ? nullptr : test::shared_cache(),
                        pool.executor(), recorder);
    std::this_thread::sleep_for(std::chrono::milliseconds(3 * round));
    session.close();
    const std::size_t heard = recorder->results().size();
    EXPECT_EQ(session.state(), State::kClosed);
    EXPECT_EQ(recorder->states().back(), State::kClosed);
    EXPECT_THROW(session.edit({RemoveConstraint{1}}), Error);
    EXPECT_THROW(session.solve_cold(), Error);
    session.cancel();
    session.close();
    EXPECT_EQ(recorder->results().size(), heard);
    EXPECT_THAT(recorder->states(), ::testing::SizeIs(::testing::Le(2u)));
    EXPECT_EQ(session.scene().constraints.size(), 2u);
    EXPECT_EQ(recorder->fault(), "");
  }
}

TEST(SessionConcurrency, CloseFromItsOwnListener) {
  Hooked hooked;
  hooked.recorder->hook = [&](const BodyResult&) { hooked.session.get()->close(); };
  Pool pool(1);
  BodySession session("closing", small_bar(), {}, test::shared_cache(), pool.executor(),
                      hooked.recorder);
  hooked.promise.set_value(&session);
  ASSERT_TRUE(hooked.recorder->wait_state(State::kClosed));
  EXPECT_THAT(hooked.recorder->results(), ::testing::SizeIs(1));
  EXPECT_EQ(hooked.recorder->fault(), "");
  session.close();
  EXPECT_THAT(hooked.recorder->states(), ::testing::ElementsAre(State::kReady, State::kClosed));
}

TEST(SessionConcurrency, DestroyedByItsOwnListener) {
  Pool pool(1);
  const auto recorder = std::make_shared<Recorder>();
  std::promise<std::unique_ptr<BodySession>> promise;
  auto future = promise.get_future();
  recorder->hook = [&](const BodyResult&) {
    if (future.valid()) future.get().reset();
  };
  promise.set_value(std::make_unique<BodySession>("gone", small_bar(), SessionOptions{},
                                                  test::shared_cache(), pool.executor(), recorder));
  std::promise<void> after;
  while (recorder->results().empty()) std::this_thread::yield();
  pool.executor()([&] { after.set_value(); });  // the thread came back from the session
  after.get_future().wait();
  EXPECT_THAT(recorder->results(), ::testing::SizeIs(1));
}

TEST(SessionConcurrency, ListenersMayCallEverything) {
  Hooked hooked;
  std::atomic<int> calls = 0;
  hooked.recorder->hook = [&](const BodyResult& result) {
    BodySession& session = *hooked.session.get();
    (void)session.scene();
    (void)session.positions(result, 0, 1);
    (void)session.constraints();
    EXPECT_EQ(session.state(), State::kReady);
    EXPECT_GE(session.revision(), result.revision);
    if (++calls < 5) session.edit({MoveConstraint{1, {0, 0.01 * calls, 0}}});
  };
  Pool pool(1);
  BodySession session("calls", small_bar(), {}, test::shared_cache(), pool.executor(),
                      hooked.recorder);
  hooked.promise.set_value(&session);
  EXPECT_TRUE(hooked.recorder->wait_final(4));
}

TEST(SessionConcurrency, AListenerThatThrows) {
  const auto recorder = std::make_shared<Recorder>();
  recorder->hook = [](const BodyResult&) { throw std::runtime_error("no"); };
  recorder->progress_hook = [](const Progress&) { throw 7; };
  recorder->state_hook = [](State) { throw std::bad_alloc(); };
  const auto inline_executor = [](const std::function<void()>& task) { task(); };
  BodySession session("thrown at", small_bar(), {}, nullptr, inline_executor, recorder);
  EXPECT_EQ(session.state(), State::kReady);
  session.edit({MoveConstraint{1, {0, 0.01, 0}}});
  ASSERT_TRUE(session.final_result());
  EXPECT_EQ(session.final_result()->revision, 1u);
}

TEST(SessionConcurrency, AnExecutorThatRefusesOrDropsTasks) {
  enum class Mood { kRun, kThrow, kDrop } mood = Mood::kThrow;
  const Executor executor = [&](const std::function<void()>& task) {
    if (mood == Mood::kThrow) throw std::runtime_error("full");
    if (mood == Mood::kRun) task();
  };
  EXPECT_THROW(BodySession("refused", small_bar(), {}, test::shared_cache(), executor, nullptr),
               Error);
  mood = Mood::kDrop;
  BodySession session("dropped", small_bar(), {}, test::shared_cache(), executor, nullptr);
  EXPECT_EQ(session.state(), State::kBuilding);
  mood = Mood::kRun;
  session.edit({MoveConstraint{1, {0, 0.01, 0}}});
  ASSERT_EQ(session.state(), State::kReady);
  mood = Mood::kThrow;
  EXPECT_EQ(session.edit({MoveConstraint{1, {0, 0.02, 0}}}).revision,
            2u);  // accepted, not yet solved
  EXPECT_THAT(session.state_message(), ::testing::HasSubstr("full"));
  EXPECT_EQ(session.final_result()->revision, 1u);
  mood = Mood::kRun;
  session.edit({MoveConstraint{2, {0, 0.02, 0}}});
  EXPECT_EQ(session.final_result()->revision, 3u);
  EXPECT_EQ(session.constraints()[0].target.y(), 0.02);
}

TEST(SessionConcurrency, ClosingDoesNotWaitForATaskThatNeverStarts) {
  std::vector<std::function<void()>> tasks;
  const auto recorder = std::make_shared<Recorder>();
  {
    BodySession session(
        "asleep", small_bar(), {}, test::shared_cache(),
        [&](std::function<void()> task) { tasks.push_back(std::move(task)); }, recorder);
    session.close();
  }
  ASSERT_EQ(tasks.size(), 1u);
  tasks[0]();  // wakes up after its session has gone
  EXPECT_THAT(recorder->states(), ::testing::ElementsAre(State::kClosed));
  EXPECT_THAT(recorder->results(), ::testing::IsEmpty());
}

TEST(SessionConcurrency, ManySessionsShareAPool) {
  Pool pool(2);
  const scene::Scene scenes[2] = {small_bar(24), small_bar(31)};
  std::shared_ptr<const BodyResult> expected[2];
  for (int s = 0; s < 2; ++s) expected[s] = test::solve_fresh(scenes[s], test::shared_cache());
  std::vector<std::shared_ptr<Recorder>> recorders;
  std::vector<std::unique_ptr<BodySession>> sessions;
  for (int i = 0; i < 6; ++i) {
    recorders.push_back(std::make_shared<Recorder>());
    sessions.push_back(std::make_unique<BodySession>(std::to_string(i), scenes[i % 2],
                                                     SessionOptions{}, test::shared_cache(),
                                                     pool.executor(), recorders.back()));
  }
  for (int i = 0; i < 6; ++i) {
    sessions[i]->edit({MoveConstraint{1, {0, 0.09, 0}}});
    sessions[i]->edit({Undo{}});
  }
  for (int i = 0; i < 6; ++i) {
    const auto final = recorders[i]->wait_final(2);
    ASSERT_TRUE(final);
    const double energy = expected[i % 2]->report.total_energy;
    EXPECT_NEAR(final->report.total_energy, energy, 1e-6 * energy);
    EXPECT_EQ(recorders[i]->fault(), "");
    EXPECT_EQ(sessions[i]->id(), std::to_string(i));
  }
}

TEST(SessionConcurrency, TheSameEditsOneAtATimeGiveTheSameBits) {
  const auto run = [] {
    const auto inline_executor = [](const std::function<void()>& task) { task(); };
    BodySession session("again", small_bar(), {}, test::shared_cache(), inline_executor, nullptr);
    for (int i = 0; i < 5; ++i) session.edit({MoveConstraint{1, {0, 0.01 * i, 0.05}}});
    return session.final_result();
  };
  EXPECT_EQ(run()->modal, run()->modal);
}

}  // namespace
}  // namespace limber::session
