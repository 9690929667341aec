#include "server/cli/watchdog.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/post.hpp>
#include <functional>
#include <future>
#include <utility>
#include <vector>

#include "server/log/log.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using std::chrono::milliseconds;

/// Loops that come round when the test says so.
struct WatchdogTest : ::testing::Test {
  WatchdogTest() { log::set_level(log::Level::kOff); }
  void run_until(const std::function<bool()>& is_done) {
    while (!is_done()) control.run_one();
  }
  boost::asio::io_context control;
  std::vector<std::function<void()>> asked;
  int fed = 0;
  Watchdog watchdog{control, milliseconds(1),
                    [this](std::function<void()> done) { asked.push_back(std::move(done)); },
                    [this] { ++fed; }};
};

TEST_F(WatchdogTest, IsFedOnceAtTheBeginningAndThenOnlyWhenTheLoopsHaveComeRound) {
  run_until([&] { return !asked.empty(); });
  EXPECT_EQ(fed, 1);
  for (int i = 0; i < 20; ++i) control.run_one();
  EXPECT_EQ(fed, 1) << "nobody has answered";
  EXPECT_EQ(asked.size(), 1u) << "who hangs is not asked again and again";
  asked.back()();
  run_until([&] { return fed == 2; });
  EXPECT_EQ(asked.size(), 2u);
  for (int i = 0; i < 20; ++i) control.run_one();
  EXPECT_EQ(fed, 2);
}

TEST(WatchedServer, LoopsOfAServerComeRoundUnlessOneOfThemHangs) {
  web::Options pages;
  pages.address = "127.0.0.1:0";
  RunningServer server(test_options(), pages);
  std::promise<void> round;
  server->ask_loops([&] { round.set_value(); });
  round.get_future().wait();

  // The loop of the timers hangs: nothing is said to have come round before it goes on.
  std::promise<void> hold, held;
  boost::asio::post(server->control(), [&] {
    held.set_value();
    hold.get_future().wait();
  });
  held.get_future().wait();
  std::atomic<bool> has_come_round{false};
  std::promise<void> later;
  server->ask_loops([&] {
    has_come_round = true;
    later.set_value();
  });
  Client client(server->request_endpoint());
  EXPECT_TRUE(client.call(info_request()).has_get_server_info());  // after the ask, on its loop
  EXPECT_FALSE(has_come_round);
  hold.set_value();
  later.get_future().wait();
}

}  // namespace
}  // namespace limber::server
