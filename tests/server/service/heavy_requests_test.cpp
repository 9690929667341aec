#include "server/service/heavy_requests.h"

#include <gmock/gmock.h>

#include <boost/asio/post.hpp>
#include <future>

#include "server/codec/errors.h"
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
  void add(const std::string& client, const std::string& payload) {
    requests.add({std::make_shared<Ticket>(transport, counters, open, Address{{client}, 0}, 1),
                  zmq::message_t(payload)});
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
  HeavyRequests requests{pool, 1, 1000, [this](HeavyRequests::Request request) {
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

}  // namespace
}  // namespace limber::server
