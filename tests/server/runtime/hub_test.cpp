#include "server/runtime/hub.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using Clock = std::chrono::steady_clock;

TEST(Hub, FirstFramesAreLetOutBeforeAnythingIsRefined) {
  std::promise<Clock::time_point> refined;
  Hub hub(test_options());
  const session::Executor executor = hub.session_executor("client");
  const auto begin = Clock::now();
  executor([&] { refined.set_value(Clock::now()); }, session::Urgency::kRefining);
  EXPECT_GE(refined.get_future().get() - begin, Hub::kRefinementDelay);
  hub.refine_pool.join();
}

TEST(Hub, WhatIsSolvedPromptlyMeanwhileTakesThePlaceOfWhatWasToBeRefined) {
  std::atomic<int> refined{0}, solved{0};
  Hub hub(test_options());
  const session::Executor executor = hub.session_executor("client");
  bool is_in_time = false;
  for (int attempt = 0; attempt < 100 && !is_in_time; ++attempt) {  // of a machine in use
    refined = 0;
    const auto begin = Clock::now();
    executor([&] { ++refined; }, session::Urgency::kRefining);
    executor([&] { ++solved; }, session::Urgency::kPrompt);
    is_in_time = Clock::now() - begin < Hub::kRefinementDelay;
  }
  ASSERT_TRUE(is_in_time);
  hub.refine_pool.join();  // behind the delay
  hub.solve_pool.join();
  EXPECT_EQ(refined, 0);
  EXPECT_GT(solved, 0);
}

TEST(Hub, LongTasksLeaveAPlaceToShortOnes) {
  ServerOptions options = test_options();
  options.session_threads = 1;
  Hub hub(options);
  std::promise<void> gate, checked;
  const auto opened = gate.get_future().share();
  std::promise<void> built[2];
  std::atomic<int> begun{0};
  const session::Executor executors[] = {hub.session_executor("a"), hub.session_executor("b")};
  for (int i = 0; i < 2; ++i) {
    executors[i]([&built, i] { built[i].set_value(); }, session::Urgency::kPatient);
    built[i].get_future().wait();
  }
  for (const auto& executor : executors) {
    executor(
        [&begun, opened] {
          ++begun;
          opened.wait();
        },
        session::Urgency::kLong);
  }
  executors[1]([&checked] { checked.set_value(); }, session::Urgency::kPatient);
  EXPECT_EQ(checked.get_future().wait_for(std::chrono::seconds(20)), std::future_status::ready);
  EXPECT_LE(begun, 1) << "the other one waits for its place";
  gate.set_value();
  hub.session_pool.join();
  EXPECT_EQ(begun, 2);
}

}  // namespace
}  // namespace limber::server
