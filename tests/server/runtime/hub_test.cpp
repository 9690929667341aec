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

}  // namespace
}  // namespace limber::server
