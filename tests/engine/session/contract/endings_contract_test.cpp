// How solves, builds and sessions of every kind end: cancelled, failed, closed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "tests/engine/session/contract/kinds.h"
#include "tests/engine/session/contract/live.h"

namespace limber::session::contract {
namespace {

template <class Kind>
class SessionEndingsContract : public ::testing::Test {};
TYPED_TEST_SUITE(SessionEndingsContract, Kinds, KindNames);

/// A later edit is accepted, solved to its end and not cancelled.
template <class Kind>
void expect_works(Live<Kind>& live, int number) {
  const Revision revision = live.solve(Kind::number(number));
  const ResultHeader final = live.final_header();
  EXPECT_EQ(final.revision, revision);
  EXPECT_FALSE(final.is_cancelled) << final.message;
  EXPECT_FALSE(final.solve_failed) << final.message;
  EXPECT_EQ(live.number(), number);
}

template <class Kind>
void expect_refuses(Live<Kind>& live) {
  const Revision revision = live.session->revision();
  const int number = live.number();
  const Error error = refusal([&] { live.edit(Kind::number(number + 1)); });
  EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
  EXPECT_EQ(live.session->revision(), revision);
  EXPECT_EQ(live.number(), number);
}

template <class Kind>
void expect_without_model(Live<Kind>& live) {
  EXPECT_EQ(live.session->state(), State::kFailed);
  EXPECT_EQ(live.recorder->states(), std::vector{State::kFailed});
  EXPECT_NE(live.recorder->state_message(), "");
  if constexpr (Kind::kHasStateMessage) {
    EXPECT_EQ(Kind::state_message(*live.session), live.recorder->state_message());
  }
  EXPECT_FALSE(Kind::newest_result(*live.session));
  expect_refuses(live);
  EXPECT_EQ(live.executor.waiting(), 0U);
}

TYPED_TEST(SessionEndingsContract, CancelWhileIdleChangesNothing) {
  Live<TypeParam> live;
  live.run();
  const auto newest = TypeParam::newest_result(*live.session);
  live.session->cancel();
  EXPECT_EQ(live.executor.waiting(), 0U);
  live.run();
  EXPECT_EQ(TypeParam::newest_result(*live.session), newest);
  EXPECT_EQ(live.session->state(), State::kReady);
  expect_works(live, 1);
}

TYPED_TEST(SessionEndingsContract, CancelBeforeTheSolveEndsItWithItsRevision) {
  Live<TypeParam> live;
  live.run();
  live.edit(TypeParam::number(1));
  live.edit(TypeParam::number(2));
  live.session->cancel();
  live.run();
  const ResultHeader cancelled = live.final_header();
  EXPECT_EQ(cancelled.revision, 2U) << "what was accepted is in it";
  EXPECT_TRUE(cancelled.is_cancelled);
  EXPECT_FALSE(cancelled.solve_failed);
  EXPECT_EQ(live.session->state(), State::kReady);
  EXPECT_EQ(live.number(), 2);
  expect_works(live, 3);
}

TYPED_TEST(SessionEndingsContract, AnEditAfterCancelIsSolved) {
  Live<TypeParam> live;
  live.run();
  live.edit(TypeParam::number(1));
  live.session->cancel();
  expect_works(live, 2);
}

TYPED_TEST(SessionEndingsContract, CancelDuringASolveEndsIt) {
  Live<TypeParam> live;
  live.run();
  bool is_cancelled = false;
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (!result.is_final && !std::exchange(is_cancelled, true)) live.session->cancel();
  });
  live.solve(TypeParam::slow_edits());
  ASSERT_TRUE(is_cancelled) << "no iterate was published";
  const ResultHeader cancelled = live.final_header();
  EXPECT_EQ(cancelled.revision, 1U);
  EXPECT_TRUE(cancelled.is_cancelled);
  EXPECT_FALSE(cancelled.solve_failed);
  EXPECT_EQ(live.session->state(), State::kReady);
  EXPECT_EQ(live.recorder->states(), std::vector{State::kReady});
  expect_works(live, 1);
}

TYPED_TEST(SessionEndingsContract, CancelWhileItBuilds) {
  const auto expect_cancelled = [](Live<TypeParam>& live) {
    if constexpr (TypeParam::kCancelFailsBuild) {
      expect_without_model(live);
    } else {
      EXPECT_EQ(live.session->state(), State::kReady);
      const ResultHeader cancelled = live.final_header();
      EXPECT_EQ(cancelled.revision, 1U);
      EXPECT_TRUE(cancelled.is_cancelled);
      EXPECT_FALSE(cancelled.solve_failed);
      expect_works(live, 2);
    }
  };
  {
    Live<TypeParam> live;
    live.edit(TypeParam::number(1));
    live.session->cancel();
    live.run();
    expect_cancelled(live);
  }
  if constexpr (TypeParam::kReportsProgress) {
    Live<TypeParam> live;
    live.edit(TypeParam::number(1));
    live.recorder->set_progress_hook([&] { live.session->cancel(); });
    live.run();
    expect_cancelled(live);
  }
}

TYPED_TEST(SessionEndingsContract, ABuildThatFailsIsToldAndRefusesEdits) {
  if constexpr (TypeParam::kBuildCanFail) {
    Live<TypeParam> live(TypeParam::open_failing);
    live.run();
    expect_without_model(live);
    live.session->cancel();
    live.run();
    expect_without_model(live);
    live.session->close();
    EXPECT_EQ(live.recorder->states(), (std::vector{State::kFailed, State::kClosed}));
    EXPECT_TRUE(live.recorder->results().empty());
  }
}

TYPED_TEST(SessionEndingsContract, ASolveThatFailsEndsWithAFailedResult) {
  if constexpr (TypeParam::kSolveCanFail) {
    Live<TypeParam> live(TypeParam::open_fragile);
    live.run();
    const std::vector<double> opened = live.answer();
    const auto expect_failed = [&](Revision revision) {
      const ResultHeader failed = live.final_header();
      EXPECT_EQ(failed.revision, revision);
      EXPECT_TRUE(failed.solve_failed);
      EXPECT_FALSE(failed.is_cancelled);
      EXPECT_NE(failed.message, "");
      EXPECT_EQ(live.session->state(), State::kReady);
      EXPECT_EQ(live.recorder->results().back().sequence, failed.sequence);
    };
    expect_failed(live.solve(TypeParam::failing_edits()));
    live.undo();
    EXPECT_FALSE(live.final_header().solve_failed) << live.final_header().message;
    EXPECT_TRUE(live.answer() == opened) << "undo gives back the answer from before";
    expect_failed(live.redo());
    live.solve(TypeParam::mending_edits());
    EXPECT_FALSE(live.final_header().solve_failed) << live.final_header().message;
    expect_works(live, 1);
  }
}

TYPED_TEST(SessionEndingsContract, ClosedItRefusesEditsAndKeepsItsResults) {
  Live<TypeParam> live;
  live.solve(TypeParam::number(1));
  const auto newest = TypeParam::newest_result(*live.session);
  const std::size_t results = live.recorder->results().size();
  live.session->close();
  EXPECT_EQ(live.session->state(), State::kClosed);
  EXPECT_EQ(live.recorder->states(), (std::vector{State::kReady, State::kClosed}));
  expect_refuses(live);
  live.session->cancel();
  live.session->close();
  EXPECT_EQ(live.executor.waiting(), 0U);
  EXPECT_EQ(live.recorder->states(), (std::vector{State::kReady, State::kClosed}));
  EXPECT_EQ(live.recorder->results().size(), results);
  EXPECT_EQ(TypeParam::newest_result(*live.session), newest);
  TypeParam::read_everything(*live.session);
}

TYPED_TEST(SessionEndingsContract, CloseDoesNotWaitForATaskThatNeverStarted) {
  Live<TypeParam> opening;
  opening.session->close();
  EXPECT_EQ(opening.recorder->states(), std::vector{State::kClosed});
  opening.run();
  EXPECT_EQ(opening.recorder->states(), std::vector{State::kClosed});
  EXPECT_TRUE(opening.recorder->results().empty());
  EXPECT_EQ(opening.session->state(), State::kClosed);

  Live<TypeParam> edited;
  edited.run();
  const std::size_t results = edited.recorder->results().size();
  edited.edit(TypeParam::number(1));
  edited.session->close();
  edited.run();
  EXPECT_EQ(edited.recorder->states(), (std::vector{State::kReady, State::kClosed}));
  EXPECT_EQ(edited.recorder->results().size(), results);
}

TYPED_TEST(SessionEndingsContract, CloseFromItsListener) {
  const auto expect_closed = [](Live<TypeParam>& live, const std::vector<State>& states) {
    EXPECT_EQ(live.session->state(), State::kClosed);
    EXPECT_EQ(live.recorder->states(), states);
    expect_refuses(live);
    live.session->close();
    EXPECT_EQ(live.recorder->states(), states) << "reported once";
  };
  if constexpr (TypeParam::kReportsProgress) {
    Live<TypeParam> live;
    live.recorder->set_progress_hook([&] { live.session->close(); });
    live.run();
    expect_closed(live, {State::kClosed});
    EXPECT_TRUE(live.recorder->results().empty());
  }
  {
    Live<TypeParam> live;
    live.recorder->set_state_hook([&](State) { live.session->close(); });
    live.run();
    expect_closed(live, {State::kReady, State::kClosed});
    EXPECT_TRUE(live.recorder->results().empty());
  }
  {
    Live<TypeParam> live;
    live.recorder->set_result_hook([&](const ResultHeader&) {
      live.session->close();
      EXPECT_EQ(live.recorder->states(), std::vector{State::kReady})
          << "reported when it has ended";
    });
    live.run();
    expect_closed(live, {State::kReady, State::kClosed});
    EXPECT_EQ(live.recorder->results().size(), 1U);
  }
}

TYPED_TEST(SessionEndingsContract, CloseFromItsListenerDuringASolve) {
  Live<TypeParam> live;
  live.run();
  const std::size_t results = live.recorder->results().size();
  live.recorder->set_result_hook([&](const ResultHeader&) { live.session->close(); });
  live.solve(TypeParam::slow_edits());
  ASSERT_EQ(live.recorder->results().size(), results + 1);
  EXPECT_FALSE(live.recorder->results().back().is_final);
  EXPECT_EQ(live.recorder->states(), (std::vector{State::kReady, State::kClosed}));
}

TYPED_TEST(SessionEndingsContract, CloseFromAnotherThreadReturnsWhenNothingRuns) {
  Gate gate;
  Threaded<TypeParam> live;
  ASSERT_TRUE(live.recorder->wait_final(0));
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (result.revision == 1) gate.pass();
  });
  live.session->edit(TypeParam::slow_edits());
  ASSERT_TRUE(gate.wait_reached()) << "no result was published";
  auto closed = std::async(std::launch::async, [&] {
    live.session->close();
    return live.recorder->is_inside() ? std::vector<State>() : live.recorder->states();
  });
  while (live.session->state() != State::kClosed) std::this_thread::yield();
  EXPECT_EQ(closed.wait_for(std::chrono::milliseconds(5)), std::future_status::timeout)
      << "its listener is still busy";
  EXPECT_EQ(live.recorder->states(), std::vector{State::kReady});
  const std::size_t results = live.recorder->results().size();
  gate.open();
  EXPECT_EQ(closed.get(), (std::vector{State::kReady, State::kClosed}));
  EXPECT_EQ(live.recorder->results().size(), results);
}

TYPED_TEST(SessionEndingsContract, ManyMayCloseAtOnce) {
  Threaded<TypeParam> live;
  live.session->edit(TypeParam::slow_edits());
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&] { live.session->close(); });
  for (std::thread& thread : threads) thread.join();
  live.session->close();
  const auto states = live.recorder->states();
  ASSERT_FALSE(states.empty());
  EXPECT_EQ(states.back(), State::kClosed);
  EXPECT_EQ(std::count(states.begin(), states.end(), State::kClosed), 1);
}

TYPED_TEST(SessionEndingsContract, DestroyedWithoutCloseItTellsNothing) {
  Live<TypeParam> idle;
  idle.run();
  idle.session.reset();
  EXPECT_EQ(idle.recorder->states(), std::vector{State::kReady});

  Live<TypeParam> opening;
  opening.session.reset();
  opening.run();
  EXPECT_TRUE(opening.recorder->states().empty());
  EXPECT_TRUE(opening.recorder->results().empty());

  Live<TypeParam> edited;
  edited.run();
  const std::size_t results = edited.recorder->results().size();
  edited.edit(TypeParam::number(1));
  edited.session.reset();
  edited.run();
  EXPECT_EQ(edited.recorder->states(), std::vector{State::kReady});
  EXPECT_EQ(edited.recorder->results().size(), results);
}

TYPED_TEST(SessionEndingsContract, DestroyedByItsListener) {
  Live<TypeParam> live;
  live.recorder->set_result_hook([&](const ResultHeader&) { live.session.reset(); });
  live.run();
  EXPECT_EQ(live.recorder->states(), std::vector{State::kReady});
  EXPECT_EQ(live.recorder->results().size(), 1U);
}

}  // namespace
}  // namespace limber::session::contract
