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
  Hub hub(test_options());
  const session::Executor executor = hub.session_executor("client");
  std::promise<Clock::time_point> solved, refined;
  const auto begin = Clock::now();
  executor([&] { solved.set_value(Clock::now()); }, session::Urgency::kPrompt);
  executor([&] { refined.set_value(Clock::now()); }, session::Urgency::kRefining);
  EXPECT_LE(begin, solved.get_future().get());  // runs, without that wait
  EXPECT_GE(refined.get_future().get() - begin, Hub::kUntilSeen);
}

TEST(Hub, WhatIsSolvedPromptlyMeanwhileTakesThePlaceOfWhatWasToBeRefined) {
  Hub hub(test_options());
  const session::Executor executor = hub.session_executor("client");
  std::promise<void> solved;
  std::atomic<bool> is_refined{false};
  executor([&] { is_refined = true; }, session::Urgency::kRefining);
  executor([&] { solved.set_value(); }, session::Urgency::kPrompt);
  solved.get_future().wait();
  hub.refine_pool.join();  // behind the pause
  EXPECT_FALSE(is_refined);
}

}  // namespace
}  // namespace limber::server
