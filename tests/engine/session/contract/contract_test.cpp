// What every kind of session does with edits: numbers, order, interruption, undo.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <new>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/engine/session/contract/kinds.h"
#include "tests/engine/session/contract/live.h"

namespace limber::session::contract {
namespace {

using ::testing::StartsWith;

template <class Kind>
class SessionContract : public ::testing::Test {};
TYPED_TEST_SUITE(SessionContract, Kinds, KindNames);

/// Of the results from this one on, amendments aside.
std::vector<ResultHeader> solved_from(const std::vector<ResultHeader>& results, std::size_t first) {
  std::vector<ResultHeader> solved;
  for (std::size_t i = first; i < results.size(); ++i)
    if (!results[i].is_amendment) solved.push_back(results[i]);
  return solved;
}

std::size_t count_final(const std::vector<ResultHeader>& results, Revision revision) {
  return static_cast<std::size_t>(
      std::count_if(results.begin(), results.end(), [=](const ResultHeader& result) {
        return result.is_final && !result.is_amendment && result.revision == revision;
      }));
}

TYPED_TEST(SessionContract, OpensAtRevisionZeroWithAFinalResult) {
  Live<TypeParam> live;
  EXPECT_EQ(live.session->id(), "contract");
  EXPECT_EQ(live.session->state(), State::kBuilding);
  EXPECT_FALSE(TypeParam::newest_result(*live.session));
  EXPECT_FALSE(TypeParam::final_result(*live.session));
  EXPECT_TRUE(live.recorder->states().empty()) << "before its task runs";
  live.run();
  EXPECT_EQ(live.session->state(), State::kReady);
  EXPECT_EQ(live.session->revision(), 0U);
  EXPECT_EQ(live.recorder->states(), std::vector{State::kReady});
  const ResultHeader opened = live.final_header();
  EXPECT_EQ(opened.revision, 0U);
  EXPECT_FALSE(opened.solve_failed) << opened.message;
  EXPECT_FALSE(opened.is_cancelled);
  EXPECT_EQ(TypeParam::newest_result(*live.session), TypeParam::final_result(*live.session));
}

TYPED_TEST(SessionContract, RevisionsCountEditsAndSequencesCountResults) {
  Live<TypeParam> live;
  live.run();
  for (int i = 1; i <= 4; ++i) {
    EXPECT_EQ(live.solve(TypeParam::number(i)), static_cast<Revision>(i));
    EXPECT_EQ(live.session->revision(), static_cast<Revision>(i));
    const ResultHeader final = live.final_header();
    EXPECT_EQ(final.revision, static_cast<Revision>(i));
    EXPECT_FALSE(final.solve_failed) << final.message;
    EXPECT_EQ(count_final(live.recorder->results(), final.revision), 1U);
  }
  const auto results = live.recorder->results();
  for (std::size_t i = 0; i < results.size(); ++i) {
    EXPECT_EQ(results[i].sequence, i + 1);
    if (i > 0) {
      EXPECT_GE(results[i].revision, results[i - 1].revision);
    }
  }
  EXPECT_EQ(results.back().sequence, live.final_header().sequence);
}

TYPED_TEST(SessionContract, OneRequestIsOneRevision) {
  Live<TypeParam> live;
  live.run();
  auto edits = TypeParam::number(3);
  const auto others = TypeParam::number(5, 1);
  edits.insert(edits.end(), others.begin(), others.end());
  EXPECT_EQ(live.solve(edits), 1U);
  EXPECT_EQ(live.number(0), 3);
  EXPECT_EQ(live.number(1), 5);
  EXPECT_EQ(live.undo(), 2U);
  EXPECT_EQ(live.number(0), 0);
  EXPECT_EQ(live.number(1), 0);
}

TYPED_TEST(SessionContract, EditsWhileItBuildsAreInTheFirstResult) {
  Live<TypeParam> live;
  live.edit(TypeParam::number(1));
  live.edit(TypeParam::number(2));
  EXPECT_EQ(live.executor.waiting(), 1U);
  live.run();
  const auto results = live.recorder->results();
  ASSERT_FALSE(results.empty());
  EXPECT_EQ(results.front().revision, 2U);
  EXPECT_EQ(live.final_header().revision, 2U);
}

TYPED_TEST(SessionContract, QuickEditsAreCoalesced) {
  constexpr int kEdits = 20;
  Live<TypeParam> live;
  live.run();
  const std::size_t before = live.recorder->results().size();
  for (int i = 1; i <= kEdits; ++i) live.edit(TypeParam::number(i));
  EXPECT_EQ(live.executor.waiting(), 1U) << "one task for all";
  live.run();
  std::set<Revision> solved;
  for (const ResultHeader& result : solved_from(live.recorder->results(), before))
    solved.insert(result.revision);
  EXPECT_LE(solved.size(), 3U);
  EXPECT_TRUE(solved.contains(kEdits));
  const ResultHeader final = live.final_header();
  EXPECT_EQ(final.revision, static_cast<Revision>(kEdits));
  EXPECT_FALSE(final.solve_failed) << final.message;
  EXPECT_EQ(live.number(), kEdits);
}

TYPED_TEST(SessionContract, EditsDuringASolveAreCoalesced) {
  constexpr int kEdits = 20;
  Live<TypeParam> live;
  live.run();
  bool is_done = false;
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (result.is_final || result.revision != 1 || std::exchange(is_done, true)) return;
    for (int i = 1; i <= kEdits; ++i) live.edit(TypeParam::number(i));
  });
  live.solve(TypeParam::slow_edits());
  ASSERT_TRUE(is_done) << "no iterate was published";
  std::set<Revision> finals;
  for (const ResultHeader& result : live.recorder->results())
    if (result.is_final) finals.insert(result.revision);
  EXPECT_EQ(finals, (std::set<Revision>{0, kEdits + 1}));
  EXPECT_EQ(live.number(), kEdits);
}

TYPED_TEST(SessionContract, ARefusedEditChangesNothingAndIsNamed) {
  Live<TypeParam> live;
  live.solve(TypeParam::number(4));
  const auto newest = TypeParam::newest_result(*live.session);
  const auto final = TypeParam::final_result(*live.session);
  const std::size_t results = live.recorder->results().size();
  auto edits = TypeParam::number(7);
  edits.push_back(TypeParam::invalid_edit());
  edits.push_back(TypeParam::number(8, 1).front());
  EXPECT_THAT(refusal([&] { live.edit(edits); }).field(), StartsWith("edits[1]"));
  EXPECT_THAT(refusal([&] { live.edit({TypeParam::invalid_edit()}); }).field(),
              StartsWith("edits[0]"));
  EXPECT_EQ(live.executor.waiting(), 0U);
  live.run();
  EXPECT_EQ(live.session->revision(), 1U);
  EXPECT_EQ(live.number(0), 4);
  EXPECT_EQ(live.number(1), 0);
  EXPECT_EQ(TypeParam::newest_result(*live.session), newest);
  EXPECT_EQ(TypeParam::final_result(*live.session), final);
  EXPECT_EQ(live.recorder->results().size(), results);
  EXPECT_EQ(live.undo(), 2U) << "of the edit that was accepted";
  EXPECT_EQ(live.number(0), 0);
}

TYPED_TEST(SessionContract, AnotherExpectedRevisionIsRefused) {
  Live<TypeParam> live;
  live.run();
  EXPECT_EQ(live.edit(TypeParam::number(1), 0), 1U);
  for (const Revision expected : {0U, 2U}) {
    const Error error = refusal([&] { live.edit(TypeParam::number(2), expected); });
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_EQ(error.field(), "expected_revision");
  }
  EXPECT_EQ(live.session->revision(), 1U);
  EXPECT_EQ(live.number(), 1);
  EXPECT_EQ(live.edit(TypeParam::number(2), 1), 2U);
}

TYPED_TEST(SessionContract, ANewerEditInterruptsASolve) {
  Live<TypeParam> live;
  live.run();
  Revision newest = 0;
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (newest == 0 && result.revision == 1 && !result.is_final)
      newest = live.edit(TypeParam::number(1));
  });
  live.solve(TypeParam::slow_edits());
  ASSERT_EQ(newest, 2U) << "no iterate was published";
  const ResultHeader final = live.final_header();
  EXPECT_EQ(final.revision, 2U);
  EXPECT_FALSE(final.solve_failed) << final.message;
  EXPECT_FALSE(final.is_cancelled);
  EXPECT_EQ(count_final(live.recorder->results(), 1), 0U) << "it was superseded";
  EXPECT_EQ(live.recorder->results().back().sequence, final.sequence);
}

TYPED_TEST(SessionContract, ANewerEditFromAnotherThreadInterruptsASolve) {
  Gate gate;
  Threaded<TypeParam> live;
  ASSERT_TRUE(live.recorder->wait_final(0));
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (result.revision == 1 && !result.is_final) gate.pass();
  });
  live.session->edit(TypeParam::slow_edits());
  ASSERT_TRUE(gate.wait_reached()) << "no iterate was published";
  EXPECT_EQ(live.session->edit(TypeParam::number(1)).revision, 2U);
  gate.open();
  ASSERT_TRUE(live.recorder->wait_final(2));
  EXPECT_EQ(TypeParam::header(*TypeParam::final_result(*live.session)).revision, 2U);
  EXPECT_EQ(count_final(live.recorder->results(), 1), 0U) << "it was superseded";
}

TYPED_TEST(SessionContract, AnEditUponTheFinalResultIsSolvedNext) {
  Live<TypeParam> live;
  int edits = 0;
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (result.is_final && !result.is_amendment && edits < 3) live.edit(TypeParam::number(++edits));
  });
  live.run();
  EXPECT_EQ(live.final_header().revision, 3U);
  for (Revision revision = 0; revision <= 3; ++revision)
    EXPECT_EQ(count_final(live.recorder->results(), revision), 1U) << revision;
}

TYPED_TEST(SessionContract, UndoAndRedoGiveBackTheVeryAnswers) {
  constexpr int kEdits = 3;
  Live<TypeParam> live;
  live.run();
  std::vector<std::vector<double>> answers = {live.answer()};
  for (int i = 1; i <= kEdits; ++i) {
    live.solve(TypeParam::number(4 * i));
    answers.push_back(live.answer());
    ASSERT_NE(answers[static_cast<std::size_t>(i)], answers[static_cast<std::size_t>(i) - 1]);
  }
  Revision revision = kEdits;
  const auto expect_answer = [&](int i) {
    EXPECT_EQ(live.final_header().revision, revision);
    EXPECT_FALSE(live.final_header().solve_failed) << live.final_header().message;
    EXPECT_EQ(live.number(), 4 * i);
    EXPECT_TRUE(live.answer() == answers[static_cast<std::size_t>(i)]) << "that of number " << i;
  };
  for (int i = kEdits - 1; i >= 0; --i) {
    EXPECT_EQ(live.undo(), ++revision);
    expect_answer(i);
  }
  for (int i = 1; i <= kEdits; ++i) {
    EXPECT_EQ(live.redo(), ++revision);
    expect_answer(i);
  }
  EXPECT_EQ(live.solve({Undo{}, Undo{}}), ++revision);
  expect_answer(1);
  // An interrupted solve does not change what undo comes back to.
  bool is_undone = false;
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    if (!result.is_final && !std::exchange(is_undone, true)) live.edit({Undo{}});
  });
  live.solve(TypeParam::slow_edits());
  ASSERT_TRUE(is_undone) << "no iterate was published";
  revision += 2;
  expect_answer(1);
}

TYPED_TEST(SessionContract, UndoBeyondTheBeginningIsRefused) {
  Live<TypeParam> live;
  live.run();
  const auto expect_refused = [&](const typename TypeParam::Edits& edits, const std::string& what) {
    const Error error = refusal([&] { live.edit(edits); });
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(error.field(), StartsWith("edits[0]"));
    EXPECT_THAT(error.what(), ::testing::HasSubstr("nothing to " + what));
  };
  expect_refused({Undo{}}, "undo");
  expect_refused({Redo{}}, "redo");
  live.edit(TypeParam::number(1));
  expect_refused({Redo{}}, "redo");
  live.edit({Undo{}});
  expect_refused({Undo{}}, "undo");
  live.edit({Redo{}});
  EXPECT_EQ(live.session->revision(), 3U);
  EXPECT_EQ(live.number(), 1);
  live.edit({Undo{}});
  live.edit(TypeParam::number(2));
  expect_refused({Redo{}}, "redo");
}

TYPED_TEST(SessionContract, TwoClientsEditAtOnce) {
  constexpr int kEdits = 40;
  Live<TypeParam> live;
  live.run();
  std::vector<Revision> revisions[2];
  std::atomic<int> ended = 0;
  std::vector<std::thread> clients;
  for (int client = 0; client < 2; ++client) {
    clients.emplace_back([&, client] {
      for (int i = 1; i <= kEdits; ++i) {
        revisions[client].push_back(live.session->edit(TypeParam::number(i, client)).revision);
        std::this_thread::yield();
      }
      ++ended;
    });
  }
  while (ended < 2)
    if (!live.executor.run_one()) std::this_thread::yield();
  for (std::thread& client : clients) client.join();
  live.run();
  std::set<Revision> all;
  for (const auto& of_client : revisions) {
    EXPECT_TRUE(std::is_sorted(of_client.begin(), of_client.end()));
    all.insert(of_client.begin(), of_client.end());
  }
  EXPECT_EQ(all.size(), 2U * kEdits) << "each its own";
  EXPECT_EQ(*all.begin(), 1U);
  EXPECT_EQ(*all.rbegin(), 2U * kEdits);
  EXPECT_EQ(live.session->revision(), 2U * kEdits);
  EXPECT_EQ(live.number(0), kEdits);
  EXPECT_EQ(live.number(1), kEdits);
  const ResultHeader final = live.final_header();
  EXPECT_EQ(final.revision, 2U * kEdits);
  EXPECT_FALSE(final.solve_failed) << final.message;
  EXPECT_FALSE(final.is_cancelled);
  EXPECT_LE(live.executor.most_waiting(), TypeParam::kMaxTasks);
}

TYPED_TEST(SessionContract, AtMostOneTaskIsPosted) {
  Live<TypeParam> live;
  live.edit(TypeParam::number(1));
  live.run();
  int calls = 0;
  live.recorder->set_result_hook([&](const ResultHeader&) {
    if (++calls > 4) return;
    live.edit(TypeParam::number(calls));
    live.edit(TypeParam::number(calls, 1));
    if (calls == 2) live.session->cancel();
  });
  live.edit(TypeParam::number(2));
  live.session->cancel();
  live.edit(TypeParam::number(3));
  EXPECT_EQ(live.executor.waiting(), 1U);
  live.run();
  EXPECT_GT(calls, 4);
  live.edit(TypeParam::number(4));
  live.session->close();
  EXPECT_EQ(live.executor.waiting(), 1U);
  EXPECT_LE(live.executor.most_pending(), TypeParam::kMaxTasks);
}

TYPED_TEST(SessionContract, WhatIsEditedDoesNotWaitBehindBuilds) {
  ManualExecutor prompt, patient;
  const auto recorder = std::make_shared<typename TypeParam::Recorder>();
  auto session = TypeParam::open(prompt.executor(patient), recorder);
  const auto final_revision = [&] {
    const auto result = TypeParam::final_result(*session);
    return result ? TypeParam::header(*result).revision : 1000;
  };
  EXPECT_EQ(prompt.waiting(), 0U);
  EXPECT_EQ(patient.waiting(), 1U);
  patient.run_one();
  EXPECT_EQ(session->state(), State::kReady);
  EXPECT_EQ(final_revision(), 0U) << "nobody edited: solved by the same task";
  for (Revision revision = 1; revision <= 3; ++revision) {
    // What is found out about the answer before waits behind all that is urgent.
    EXPECT_EQ(session->edit(TypeParam::number(static_cast<int>(revision)), {}).revision, revision);
    EXPECT_EQ(prompt.waiting(), 1U);
    prompt.run_all();
    EXPECT_EQ(final_revision(), revision);
  }
  for (bool is_left = true; is_left;) is_left = patient.run_one() || prompt.run_one();
  EXPECT_EQ(final_revision(), 3U);
  session.reset();
  EXPECT_EQ(recorder->fault(), "");
}

TYPED_TEST(SessionContract, AnEditOfWhatIsBeingBuiltIsSolvedByAnUrgentTask) {
  ManualExecutor prompt, patient;
  const auto recorder = std::make_shared<typename TypeParam::Recorder>();
  auto session = TypeParam::open(prompt.executor(patient), recorder);
  EXPECT_EQ(session->edit(TypeParam::number(1), {}).revision, 1U);
  EXPECT_EQ(prompt.waiting(), 0U) << "there is nothing to solve yet";
  patient.run_one();
  EXPECT_EQ(session->state(), State::kReady);
  EXPECT_EQ(TypeParam::final_result(*session), nullptr);
  EXPECT_EQ(prompt.waiting(), 1U);
  prompt.run_all();
  ASSERT_NE(TypeParam::final_result(*session), nullptr);
  EXPECT_EQ(TypeParam::header(*TypeParam::final_result(*session)).revision, 1U);
  for (bool is_left = true; is_left;) is_left = patient.run_one() || prompt.run_one();
  session.reset();
  EXPECT_EQ(recorder->fault(), "");
}

TYPED_TEST(SessionContract, AnExecutorThatDropsTasksLosesNoEdit) {
  using Mode = ManualExecutor::Mode;
  Live<TypeParam> live;
  live.executor.drop_all();
  EXPECT_EQ(live.session->state(), State::kBuilding);
  live.executor.set_mode(Mode::kDrop);
  EXPECT_EQ(live.edit(TypeParam::number(1)), 1U);
  live.executor.set_mode(Mode::kKeep);
  EXPECT_EQ(live.edit(TypeParam::number(1, 1)), 2U);
  EXPECT_EQ(live.executor.waiting(), 1U);
  live.run();
  EXPECT_EQ(live.final_header().revision, 2U);
  // The same of a session that is ready.
  live.edit(TypeParam::number(2));
  live.executor.drop_all();
  live.run();
  EXPECT_EQ(live.final_header().revision, 2U);
  EXPECT_EQ(live.edit(TypeParam::number(2, 1)), 4U);
  EXPECT_EQ(live.executor.waiting(), 1U);
  live.run();
  EXPECT_EQ(live.final_header().revision, 4U);
  EXPECT_EQ(live.number(0), 2);
  EXPECT_EQ(live.number(1), 2);
}

TYPED_TEST(SessionContract, AnExecutorThatThrowsLosesNoEdit) {
  using Mode = ManualExecutor::Mode;
  ManualExecutor refusing;
  refusing.set_mode(Mode::kRefuse);
  const auto unopened = std::make_shared<typename TypeParam::Recorder>();
  EXPECT_THAT(refusal([&] { (void)TypeParam::open(refusing.executor(), unopened); }).what(),
              ::testing::HasSubstr("full"));
  EXPECT_TRUE(unopened->states().empty());
  EXPECT_THROW((void)TypeParam::open({}, unopened), Error) << "no executor";

  Live<TypeParam> live;
  live.run();
  live.executor.set_mode(Mode::kRefuse);
  EXPECT_EQ(live.edit(TypeParam::number(1)), 1U);
  EXPECT_EQ(live.session->state(), State::kReady);
  EXPECT_EQ(live.final_header().revision, 0U);
  if constexpr (TypeParam::kHasStateMessage) {
    EXPECT_THAT(TypeParam::state_message(*live.session), ::testing::HasSubstr("full"));
  }
  live.executor.set_mode(Mode::kKeep);
  EXPECT_EQ(live.edit(TypeParam::number(1, 1)), 2U);
  live.run();
  EXPECT_EQ(live.final_header().revision, 2U);
  EXPECT_EQ(live.number(0), 1);
  EXPECT_EQ(live.number(1), 1);
}

TYPED_TEST(SessionContract, AListenerThatThrowsDoesNoHarm) {
  Live<TypeParam> live;
  live.recorder->set_progress_hook([] { throw 7; });
  live.recorder->set_state_hook([](State) { throw std::bad_alloc(); });
  live.recorder->set_result_hook([](const ResultHeader&) { throw std::runtime_error("no"); });
  live.run();
  EXPECT_EQ(live.session->state(), State::kReady);
  EXPECT_EQ(live.final_header().revision, 0U);
  live.solve(TypeParam::number(1));
  const ResultHeader final = live.final_header();
  EXPECT_EQ(final.revision, 1U);
  EXPECT_FALSE(final.solve_failed) << final.message;
  live.session->close();
  EXPECT_EQ(live.recorder->states(), (std::vector{State::kReady, State::kClosed}));
}

TYPED_TEST(SessionContract, ListenersMayCallEverything) {
  Live<TypeParam> live;
  int calls = 0;
  const auto look = [&] {
    TypeParam::read_everything(*live.session);
    EXPECT_EQ(live.session->id(), "contract");
    return live.session->revision();
  };
  live.recorder->set_progress_hook([&] {
    look();
    EXPECT_EQ(live.session->state(), State::kBuilding);
  });
  live.recorder->set_state_hook([&](State state) {
    look();
    EXPECT_EQ(live.session->state(), state);
  });
  live.recorder->set_result_hook([&](const ResultHeader& result) {
    EXPECT_GE(look(), result.revision);
    EXPECT_EQ(TypeParam::header(*TypeParam::newest_result(*live.session)).sequence,
              result.sequence);
    if (result.is_final) {
      EXPECT_EQ(TypeParam::final_result(*live.session), TypeParam::newest_result(*live.session));
    }
    std::thread other([&] { look(); });
    other.join();
    if (++calls <= 3) live.edit(TypeParam::number(calls));
  });
  live.run();
  EXPECT_GT(calls, 3);
  EXPECT_EQ(live.final_header().revision, 3U);
  live.session->close();
}

}  // namespace
}  // namespace limber::session::contract
