#include <gtest/gtest.h>

#include <fstream>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerStreams : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};
  Subscriber subscriber{server->stream_endpoint()};
};

constexpr const char* kCoordinates = "session/s/body/0/coordinates";

TEST_F(ServerStreams, FramesOfEveryEditInOrder) {
  open_and_solve(client, "s");
  subscriber.subscribe(kCoordinates);
  const auto welcome = subscriber.receive();  // what is there already, without an edit
  ASSERT_TRUE(welcome.has_value());
  EXPECT_EQ(welcome->topic, kCoordinates);
  EXPECT_EQ(welcome->content.version(), 1u);
  EXPECT_EQ(welcome->content.session(), "s");
  EXPECT_EQ(welcome->content.frames().result().revision(), 0u);
  EXPECT_EQ(welcome->content.frames().data().shape(0), 20u);

  std::uint64_t sequence = welcome->content.sequence();
  for (std::uint64_t revision = 1; revision <= 20; ++revision) {
    ASSERT_TRUE(
        client.call(move_request("s", 1, 0, 0.01 * static_cast<double>(revision), 0)).has_edit());
    while (true) {
      const auto message = subscriber.receive();
      ASSERT_TRUE(message.has_value());
      // A newer one of the same edit may take the place of one that was not sent yet.
      EXPECT_GT(message->content.sequence(), sequence);
      sequence = message->content.sequence();
      const auto& result = message->content.frames().result();
      if (result.revision() == revision && result.converged()) break;
    }
  }
}

TEST_F(ServerStreams, EachEncodingUnderItsOwnTopic) {
  open_and_solve(client, "s");
  subscriber.subscribe("session/s/body/0/");
  std::map<std::string, proto::Frames> newest;
  // The error of the motion may follow in a second one of some topic meanwhile.
  for (int i = 0; i < 8 && newest.size() < 4; ++i) {
    const auto message = subscriber.receive();
    ASSERT_TRUE(message.has_value());
    newest[message->topic] = message->content.frames();
  }
  ASSERT_EQ(newest.size(), 4u);
  EXPECT_EQ(newest.at("session/s/body/0/coordinates").encoding(), proto::ENCODING_COORDINATES);
  EXPECT_EQ(newest.at("session/s/body/0/changes").encoding(), proto::ENCODING_COORDINATES);
  EXPECT_EQ(newest.at("session/s/body/0/positions").data().type(), proto::DATA_TYPE_FLOAT32);
  EXPECT_EQ(newest.at("session/s/body/0/quantised").data().type(), proto::DATA_TYPE_UINT16);
}

TEST_F(ServerStreams, NothingIsMadeForNobody) {
  open_and_solve(client, "s");
  for (int i = 0; i < 5; ++i) client.call(move_request("s", 1, 0, 0.01 * i, 0));
  ASSERT_TRUE(client.call(wait_request("s", 5)).has_wait());
  EXPECT_EQ(server->counters().published.load(), 0u);
}

TEST_F(ServerStreams, StatusAndJobs) {
  ASSERT_NO_FATAL_FAILURE(open_and_solve(client, "known"));
  subscriber.subscribe("session/s/status");
  subscriber.subscribe("jobs");
  // There is no answer to a subscription to nothing yet, and the end of a job is reported only
  // once: what is there already answers, and the server hears subscriptions in their order.
  subscriber.subscribe("session/known/status");
  ASSERT_TRUE(subscriber.receive().has_value());
  ASSERT_NO_FATAL_FAILURE(open_and_solve(client, "s"));
  bool running = false, done = false, ready = false, final = false;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!(done && ready && final)) {
    const auto message = subscriber.receive();
    ASSERT_TRUE(message.has_value()) << running << done << ready << final;
    // Statuses are published again for ever: silence does not show a missing message.
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << running << done << ready << final;
    if (message->content.session() != "s") continue;
    if (message->topic == "jobs") {
      running = running || message->content.job().state() == proto::JOB_STATE_RUNNING;
      done = done || message->content.job().state() == proto::JOB_STATE_DONE;
      EXPECT_EQ(message->content.job().kind(), "open_session");
    } else {
      ready = ready || message->content.status().state() == proto::SESSION_STATE_READY;
      final = final || message->content.status().result().converged();
    }
  }
  EXPECT_TRUE(running);
}

TEST(ServerStatus, IsPublishedAgainWithoutAnyChange) {
  ServerOptions options = test_options();
  options.status_interval = milliseconds(50);
  RunningServer server(options);
  Client client(server->request_endpoint());
  open_and_solve(client, "s");
  Subscriber subscriber(server->stream_endpoint());
  subscriber.subscribe("session/s/status");
  std::optional<Subscriber::Message> message;
  for (int i = 0; i < 5; ++i) {
    message = subscriber.receive(milliseconds(2000));
    ASSERT_TRUE(message.has_value());
  }
  EXPECT_TRUE(message->content.status().result().converged());
}

TEST_F(ServerStreams, ClosingIsReported) {
  open_and_solve(client, "s");
  subscriber.subscribe("session/s/status");
  ASSERT_TRUE(subscriber.receive().has_value());
  proto::Request request;
  request.mutable_close_session()->set_session("s");
  client.call(request);
  std::optional<Subscriber::Message> message;
  do {  // the status of the last result may still arrive
    message = subscriber.receive();
    ASSERT_TRUE(message.has_value());
  } while (message->content.status().state() != proto::SESSION_STATE_CLOSED);
}

std::size_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::size_t total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

/// A subscriber that reads nothing: the server's memory stays where it is, others get everything
/// that is final, and when it reads again it finds the newest frames by request, and sees by a gap
/// that it missed some.
TEST_F(ServerStreams, ASlowSubscriberCostsNoMemoryAndHoldsUpNobody) {
  const proto::Scene scene = small_scene(150, 400);  // 604 nodes: 2.9 MB of positions per result
  open_and_solve(client, "s", scene);
  Subscriber frozen(server->stream_endpoint(), 1);
  const std::string topic = "session/s/body/0/positions";
  frozen.socket().set(zmq::sockopt::rcvbuf, 65536);
  frozen.subscribe(topic);
  subscriber.subscribe(topic);
  ASSERT_TRUE(subscriber.receive().has_value());
  const auto edit_and_watch = [&](std::uint64_t revision) {
    const double y = 0.001 * static_cast<double>(revision % 50);
    ASSERT_EQ(client.call(move_request("s", 1, 0, y, 0)).edit().revision(), revision);
    while (true) {
      const auto message = subscriber.receive();
      ASSERT_TRUE(message.has_value()) << "held up at revision " << revision;
      const auto& result = message->content.frames().result();
      if (result.revision() == revision && result.converged()) return;
    }
  };
  std::uint64_t revision = 0;
  while (revision < 40) edit_and_watch(++revision);
  const std::size_t before = resident_bytes();
  while (revision < 120) edit_and_watch(++revision);
  const std::size_t after = resident_bytes();
  // 80 edits are at least 230 MB of positions.
  EXPECT_LT(after, before + (60u << 20));
  EXPECT_GE(server->counters().forced.load(), 1u);

  std::uint64_t last = 0, gaps = 0;
  while (const auto message = frozen.receive(milliseconds(500))) {
    if (last > 0 && message->content.sequence() != last + 1) ++gaps;
    last = message->content.sequence();
  }
  EXPECT_TRUE(gaps > 0 || last < 120) << last;
  proto::Request request;
  request.mutable_get_frames()->set_session("s");
  request.mutable_get_frames()->set_final_only(true);
  EXPECT_EQ(client.call(request).get_frames().frames().result().revision(), revision);
}

}  // namespace
}  // namespace limber::server
