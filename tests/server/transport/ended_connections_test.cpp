// Ends of connections that the transport's thread hears late, at a transport alone.
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "server/transport/transport.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using namespace std::chrono_literals;

struct Heard {
  std::mutex mutex;
  std::set<std::string> asked, ended;  // clients

  std::size_t asked_count() {
    const std::lock_guard lock(mutex);
    return asked.size();
  }
  std::size_t ended_count() {
    const std::lock_guard lock(mutex);
    return ended.size();
  }
};

TransportHandlers handlers_of(Heard& heard) {
  TransportHandlers handlers;
  handlers.on_request = [&](const Address& address, const zmq::message_t& message) {
    if (message.to_string_view() != "request") return;
    const std::lock_guard lock(heard.mutex);
    heard.asked.insert(address.envelope.front());
  };
  handlers.on_subscription = [](const std::string&, Has) {};
  handlers.overflow_reply = [](const auto&, const auto&) { return std::string("too much"); };
  handlers.on_disconnected = [&](const std::string& client) {
    const std::lock_guard lock(heard.mutex);
    heard.ended.insert(client);
  };
  return handlers;
}

std::unique_ptr<zmq::socket_t> connect(zmq::context_t& context, const std::string& endpoint,
                                       int type) {
  auto socket = std::make_unique<zmq::socket_t>(context, type);
  socket->set(zmq::sockopt::linger, 0);
  socket->connect(endpoint);
  return socket;
}

/// Each client ends, and the next takes its descriptor, while the transport's thread is busy.
/// @param next  connects, and does something that the transport reads
template <class Next>
void end_while_busy(Transport& transport, Heard& heard, const Next& next) {
  zmq::context_t context;
  constexpr std::size_t kRounds = 8;
  for (std::size_t round = 1; round <= kRounds; ++round) {
    auto client = connect(context, transport.request_endpoint(), ZMQ_DEALER);
    client->send(zmq::buffer(std::string("request")));
    for (int i = 0; i < 20'000 && heard.asked_count() < round; ++i)
      std::this_thread::sleep_for(1ms);
    ASSERT_EQ(heard.asked_count(), round);
    std::promise<void> release;
    transport.call([busy = release.get_future().share()] { busy.wait(); });
    std::this_thread::sleep_for(20ms);  // the thread has begun with it
    client.reset();
    std::this_thread::sleep_for(50ms);  // libzmq has closed the connection
    const auto newer = next(context);
    std::this_thread::sleep_for(50ms);  // its message is there, behind the end
    release.set_value();
    for (int i = 0; i < 2'000 && heard.ended_count() < round; ++i) std::this_thread::sleep_for(1ms);
    EXPECT_GE(heard.ended_count(), round);
  }
}

TEST(EndedConnections, AreNotedBeforeRequestsOfTheNextOnTheSameDescriptor) {
  Heard heard;
  Counters counters;
  Transport transport(test_options().transport, counters);
  transport.start(handlers_of(heard));
  end_while_busy(transport, heard, [&](zmq::context_t& context) {
    auto client = connect(context, transport.request_endpoint(), ZMQ_DEALER);
    client->send(zmq::buffer(std::string("of the next")));
    return client;
  });
  transport.stop();
}

TEST(EndedConnections, AreNotedBeforeSubscriptionsOfTheNextOnTheSameDescriptor) {
  Heard heard;
  Counters counters;
  Transport transport(test_options().transport, counters);
  transport.start(handlers_of(heard));
  end_while_busy(transport, heard, [&](zmq::context_t& context) {
    auto subscriber = connect(context, transport.stream_endpoint(), ZMQ_SUB);
    subscriber->set(zmq::sockopt::subscribe, "topic");
    return subscriber;
  });
  transport.stop();
}

}  // namespace
}  // namespace limber::server
