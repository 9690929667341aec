#include "server/service/heavy_requests.h"

#include <gmock/gmock.h>

#include <boost/asio/post.hpp>
#include <condition_variable>
#include <future>
#include <mutex>

#include "server/wire/errors.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using ::testing::ElementsAre;

/// One thread that is held up until the test wants to see what it does, and in what order.
struct ServerHeavyRequests : ::testing::Test {
  ServerHeavyRequests() {
    boost::asio::post(pool, [held = gate.get_future().share()] { held.wait(); });
  }
  void add(const std::string& client, const std::string& payload, const std::string& session = "") {
    requests.add({std::make_shared<Ticket>(transport, counters, open, Address{{client}, 0}, 1),
                  zmq::message_t(payload), session});
  }
  std::vector<std::string> order() {
    gate.set_value();
    pool.join();
    return worked_on;
  }

  Counters counters;
  Transport transport{test_options().transport, counters};
  OpenRequests open;
  std::promise<void> gate;
  boost::asio::thread_pool pool{1};
  std::vector<std::string> worked_on;
  WaitingBytes all_bytes{1000};
  HeavyRequests requests{pool, 1, all_bytes, [this](HeavyRequests::Request request) {
                           worked_on.push_back(request.payload.to_string().substr(0, 2));
                           request.ticket->abandon();
                         }};
};

TEST_F(ServerHeavyRequests, ClientsTakeTurns) {
  for (const auto* payload : {"a1", "a2", "a3", "a4"}) add("a", payload);
  add("b", "b1");
  add("c", "c1");
  add("b", "b2");
  EXPECT_EQ(open.of("a"), 4u);
  EXPECT_EQ(open.total(), 7u);
  EXPECT_THAT(order(), ElementsAre("a1", "b1", "c1", "a2", "b2", "a3", "a4"));
  EXPECT_EQ(open.of("a"), 0u);
  EXPECT_EQ(open.total(), 0u);
}

TEST_F(ServerHeavyRequests, OthersOfThePoolHaveTheirTurnToo) {
  for (const auto* payload : {"a1", "a2", "a3"}) add("a", payload);
  boost::asio::post(pool, [this] { worked_on.emplace_back("stream"); });
  EXPECT_THAT(order(), ElementsAre("a1", "stream", "a2", "a3"));
}

TEST_F(ServerHeavyRequests, WhatIsTakenIsNotWorkedOn) {
  for (const auto* payload : {"a1", "a2"}) add("a", payload);
  add("b", "b1");
  EXPECT_EQ(requests.take("a").size(), 2u);
  EXPECT_EQ(requests.take("a").size(), 0u);
  EXPECT_EQ(requests.take("nobody").size(), 0u);
  add("a", "a3");
  EXPECT_THAT(order(), ElementsAre("b1", "a3"));
}

TEST_F(ServerHeavyRequests, BytesAreLimitedOfOneAndOfAll) {
  const auto refused = [&](const std::string& client, std::size_t bytes) {
    try {
      add(client, std::string(bytes, 'x'));
    } catch (const Refusal& refusal) {
      EXPECT_EQ(refusal.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
      return refusal.details().at("limit");
    }
    return std::string();
  };
  EXPECT_EQ(refused("a", 300), "");
  EXPECT_EQ(refused("a", 300), "500");  // half, of one client
  EXPECT_EQ(refused("a", 200), "");
  EXPECT_EQ(refused("b", 400), "");
  EXPECT_EQ(refused("c", 200), "1000");
  EXPECT_EQ(requests.take("a").size(), 2u);
  EXPECT_EQ(refused("c", 200), "");
  EXPECT_EQ(requests.take_all().size(), 2u);
  EXPECT_EQ(refused("a", 5000), "");  // alone: the limit of a message is another
  EXPECT_EQ(order().size(), 1u);
}

TEST_F(ServerHeavyRequests, BytesAreLimitedOfAllLinesTogether) {
  HeavyRequests patient(pool, 1, all_bytes, [](const auto& request) { request.ticket->abandon(); });
  const auto refused = [&](const std::string& client, std::size_t count) {
    try {
      patient.add({std::make_shared<Ticket>(transport, counters, open, Address{{client}, 0}, 1),
                   zmq::message_t(count), ""});
    } catch (const Refusal& refusal) {
      return refusal.details().at("limit");
    }
    return std::string();
  };
  add("a", std::string(400, 'x'));
  EXPECT_EQ(refused("a", 200), "500");
  EXPECT_EQ(refused("b", 400), "");
  EXPECT_EQ(refused("c", 300), "1000");
  EXPECT_EQ(requests.take("a").size(), 1u);
  EXPECT_EQ(refused("a", 200), "");
  EXPECT_EQ(order().size(), 0u);
}

TEST_F(ServerHeavyRequests, SessionsAreBusyUntilTheirLastRequestIsDone) {
  EXPECT_FALSE(requests.is_busy("s"));
  add("a", "a1", "s");
  add("a", "a2");
  add("b", "b1", "t");
  EXPECT_TRUE(requests.is_busy("s"));
  EXPECT_TRUE(requests.is_busy("t"));
  EXPECT_EQ(requests.take("b").size(), 1u);
  EXPECT_FALSE(requests.is_busy("t"));
  EXPECT_THAT(order(), ElementsAre("a1", "a2"));
  EXPECT_FALSE(requests.is_busy("s"));
}

/// Three threads; the work of a session waits for a word of the test.
TEST(ServerHeavyRequestsOfSessions, AreWorkedOnOneAtATimeAndInOrder) {
  Counters counters;
  Transport transport(test_options().transport, counters);
  OpenRequests open;
  boost::asio::thread_pool pool(3);
  std::mutex mutex;
  std::vector<std::string> began, other;
  int running = 0, most = 0;
  std::promise<void> gate, others;
  const std::shared_future<void> opened = gate.get_future().share();
  WaitingBytes bytes(1000);
  HeavyRequests requests(pool, 3, bytes, [&](HeavyRequests::Request request) {
    const std::string payload = request.payload.to_string();
    if (request.session.empty()) {
      const std::lock_guard lock(mutex);
      other.push_back(payload);
      if (other.size() == 2) others.set_value();
    } else {
      {
        const std::lock_guard lock(mutex);
        began.push_back(payload);
        most = std::max(most, ++running);
      }
      opened.wait();
      const std::lock_guard lock(mutex);
      --running;
    }
    request.ticket->abandon();
  });
  const auto add = [&](const std::string& payload, const std::string& session) {
    requests.add({std::make_shared<Ticket>(transport, counters, open, Address{{"a"}, 0}, 1),
                  zmq::message_t(payload), session});
  };
  for (const char* payload : {"1", "2", "3", "4"}) add(payload, "s");
  add("x", "");
  add("y", "");
  // Neither waits for the session, whose first request holds one thread.
  EXPECT_EQ(others.get_future().wait_for(std::chrono::seconds(20)), std::future_status::ready);
  EXPECT_TRUE(requests.is_busy("s"));
  gate.set_value();
  pool.join();
  EXPECT_THAT(began, ElementsAre("1", "2", "3", "4"));
  EXPECT_EQ(most, 1);
  EXPECT_FALSE(requests.is_busy("s"));
}

/// Threads whose every work waits for a word of the test.
struct ServerHeavyRequestsHeldUp : ::testing::Test {
  void add(const std::string& client, const std::string& payload, const std::string& session = "",
           std::uint64_t number = 0) {
    requests.add({std::make_shared<Ticket>(transport, counters, open, Address{{client}, 0}, 1),
                  zmq::message_t(payload), session, number});
  }
  /// Until so many have begun. @returns whether they have
  bool wait_for(std::size_t count) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, std::chrono::seconds(20), [&] { return began.size() >= count; });
  }
  std::vector<std::string> so_far() {
    const std::lock_guard lock(mutex);
    return began;
  }
  std::vector<std::string> rest() {
    gate.set_value();
    pool.join();
    return began;
  }

  Counters counters;
  Transport transport{test_options().transport, counters};
  OpenRequests open;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::string> began;
  std::promise<void> gate;
  std::shared_future<void> opened = gate.get_future().share();
  boost::asio::thread_pool pool{3};
  WaitingBytes bytes{100'000'000};
  HeavyRequests requests{pool, 3, bytes, [this](HeavyRequests::Request request) {
                           {
                             const std::lock_guard lock(mutex);
                             began.push_back(request.payload.to_string());
                           }
                           changed.notify_all();
                           opened.wait();
                           request.ticket->abandon();
                         }};
};

TEST_F(ServerHeavyRequestsHeldUp, WorkIsLinearInWhatWaitsBehindASession) {
  constexpr std::uint64_t kMany = 20'000;
  add("a", "first", "s");
  ASSERT_TRUE(wait_for(1));
  for (std::uint64_t i = 1; i < kMany; ++i) add("a", std::to_string(i), "s");
  EXPECT_EQ(requests.steps().posts, 1u) << "no thread is asked for what it cannot do";
  // Others of the client, and of another one, are found beside these.
  for (std::uint64_t i = 0; i < kMany; ++i) {
    add("a", "x");
    add("b", "y", "s");
  }
  const auto done = rest();
  EXPECT_EQ(done.size(), 3 * kMany);
  EXPECT_LT(requests.steps().looks, 10 * 3 * kMany);
  EXPECT_LT(requests.steps().posts, 10u);
  EXPECT_FALSE(requests.is_busy("s"));
}

TEST_F(ServerHeavyRequestsHeldUp, SessionsLeaveAThreadToTheRest) {
  add("a", "s1", "s");
  add("a", "t1", "t");
  add("a", "u1", "u");
  add("b", "v1", "v");
  add("b", "export");
  ASSERT_TRUE(wait_for(3));
  EXPECT_EQ(so_far().size(), 3u);
  EXPECT_THAT(so_far(), ::testing::Contains("export"));
  EXPECT_EQ(rest().size(), 5u);
}

TEST_F(ServerHeavyRequestsHeldUp, ASessionThatClientsShareIsTheirsByTurns) {
  add("a", "a1", "s");
  ASSERT_TRUE(wait_for(1));
  for (const char* payload : {"a2", "a3", "a4"}) add("a", payload, "s");
  for (const char* payload : {"b1", "b2"}) add("b", payload, "s");
  EXPECT_THAT(rest(), ElementsAre("a1", "a2", "b1", "a3", "b2", "a4"));
}

/// As those that a client repeated on another connection, where it sends more meanwhile.
TEST_F(ServerHeavyRequestsHeldUp, WhatIsTakenMayComeBackToItsPlace) {
  add("z", "z", "s");
  ASSERT_TRUE(wait_for(1));
  for (const char* payload : {"1", "2", "3"}) add("old", payload, "s");
  for (const char* payload : {"4", "5"}) add("new", payload, "s");
  for (auto& request : requests.take("old"))
    add("new", request.payload.to_string(), request.session, request.number);
  EXPECT_TRUE(requests.is_busy("s"));
  EXPECT_THAT(rest(), ElementsAre("z", "1", "2", "3", "4", "5"));
  EXPECT_FALSE(requests.is_busy("s"));
}

}  // namespace
}  // namespace limber::server
