// Those who follow streams, at a transport alone.
#include <gtest/gtest.h>

#include <string>
#include <vector>
#include <zmq.hpp>
#include <zmq_addon.hpp>

#include "server/transport/transport.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

TEST(Follow, MessagesComeBehindTheAnswer) {
  Counters counters;
  Transport transport(test_options().transport, counters);
  TransportHandlers handlers;
  handlers.on_request = [&](Address address, const zmq::message_t&) {
    const Following wanted{"stream", {{"topic", 0}}, 0, 0, 1, "Ana"};
    transport.follow(address, wanted, [&](const FollowAnswer& answer) {
      EXPECT_FALSE(answer.continued);
      transport.publish("topic", {"published before the answer is on its way"});
      transport.send(address, "answer");
    });
    transport.publish("topic", {"published behind it"}, TopicSlots::Keep::kOrder);
  };
  handlers.on_subscription = [&](const std::string& prefix, Has) {
    EXPECT_EQ(prefix, "topic");
    transport.publish("topic", {"snapshot"}, TopicSlots::Keep::kOrder);
  };
  handlers.overflow_reply = [](const auto&, const auto&) { return std::string("too much"); };
  transport.start(handlers);
  zmq::context_t context;
  zmq::socket_t client(context, ZMQ_DEALER);
  client.set(zmq::sockopt::linger, 0);
  client.set(zmq::sockopt::rcvtimeo, 20'000);
  client.connect(transport.request_endpoint());
  client.send(zmq::buffer(std::string("request")));
  std::vector<std::string> received;
  for (bool is_last = false; !is_last;) {
    std::vector<zmq::message_t> parts;
    ASSERT_TRUE(zmq::recv_multipart(client, std::back_inserter(parts)));
    received.push_back(parts.size() == 1 ? parts[0].to_string() : parts.at(1).to_string());
    is_last = received.back().starts_with("snapshot");
  }
  transport.stop();
  EXPECT_EQ(received.front(), "answer");
  EXPECT_GT(received.size(), 2U);
}

}  // namespace
}  // namespace limber::server
