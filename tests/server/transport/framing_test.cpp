#include <gtest/gtest.h>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

std::string info_bytes(std::uint64_t id) {
  proto::Request request = info_request();
  request.set_version(1);
  request.set_id(id);
  return request.SerializeAsString();
}

proto::Reply parse(const zmq::message_t& message) {
  proto::Reply reply;
  EXPECT_TRUE(reply.ParseFromArray(message.data(), static_cast<int>(message.size())));
  return reply;
}

std::vector<zmq::message_t> receive_all(zmq::socket_t& socket, int timeout_ms = 10000) {
  socket.set(zmq::sockopt::rcvtimeo, timeout_ms);
  std::vector<zmq::message_t> frames;
  (void)zmq::recv_multipart(socket, std::back_inserter(frames));
  return frames;
}

struct ServerFraming : ::testing::Test {
  RunningServer server;
  zmq::context_t context;
  zmq::socket_t socket(int type) {
    zmq::socket_t made(context, type);
    made.set(zmq::sockopt::linger, 0);
    made.connect(server->request_endpoint());
    return made;
  }
};

TEST_F(ServerFraming, ReqClients) {
  auto req = socket(ZMQ_REQ);
  for (std::uint64_t id = 1; id < 4; ++id) {
    req.send(zmq::buffer(info_bytes(id)));
    const auto frames = receive_all(req);
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(parse(frames[0]).id(), id);
  }
}

TEST_F(ServerFraming, DealersWithAndWithoutDelimiter) {
  auto dealer = socket(ZMQ_DEALER);
  dealer.send(zmq::buffer(info_bytes(1)));
  EXPECT_EQ(receive_all(dealer).size(), 1u);
  dealer.send(zmq::message_t(), zmq::send_flags::sndmore);
  dealer.send(zmq::buffer(info_bytes(2)));
  const auto frames = receive_all(dealer);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0].size(), 0u);
  EXPECT_EQ(parse(frames[1]).id(), 2u);
}

TEST_F(ServerFraming, EnvelopesOfProxiesComeBack) {
  auto dealer = socket(ZMQ_DEALER);
  dealer.send(zmq::str_buffer("hop"), zmq::send_flags::sndmore);
  dealer.send(zmq::message_t(), zmq::send_flags::sndmore);
  dealer.send(zmq::buffer(info_bytes(3)));
  const auto frames = receive_all(dealer);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].to_string(), "hop");
  EXPECT_EQ(parse(frames[2]).id(), 3u);
}

TEST_F(ServerFraming, SeveralFramesWithoutDelimiterAreMalformed) {
  auto dealer = socket(ZMQ_DEALER);
  dealer.send(zmq::str_buffer("one"), zmq::send_flags::sndmore);
  dealer.send(zmq::buffer(info_bytes(3)));
  const auto frames = receive_all(dealer);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(parse(frames[1]).error().code(), proto::ERROR_CODE_MALFORMED);
}

TEST_F(ServerFraming, EnvelopesWithoutEndAreCountedAndDropped) {
  auto dealer = socket(ZMQ_DEALER);
  for (int i = 0; i < 40; ++i) dealer.send(zmq::str_buffer("x"), zmq::send_flags::sndmore);
  dealer.send(zmq::str_buffer("y"));
  dealer.send(zmq::buffer(info_bytes(9)));
  const auto frames = receive_all(dealer);  // only the second message is answered
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(parse(frames[0]).id(), 9u);
  EXPECT_EQ(server->counters().dropped_requests.load(), 1u);
}

TEST_F(ServerFraming, RepliesToTheDeadAreCountedAndDropped) {
  Client alive(server->request_endpoint());
  ASSERT_TRUE(alive.call(open_request(small_scene(), "x")).has_open_session());
  {
    Client dead(server->request_endpoint());
    ASSERT_TRUE(dead.call(info_request()).has_get_server_info());
    dead.send(wait_request("x", 1000, 0.5));  // nobody will make that revision
    ASSERT_TRUE(dead.call(info_request()).has_get_server_info());
  }
  for (int i = 0; i < 300 && server->counters().dropped_replies.load() == 0; ++i) {
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_EQ(server->counters().dropped_replies.load(), 1u);
  EXPECT_TRUE(alive.call(info_request()).has_get_server_info());
}

TEST_F(ServerFraming, ManyInFlightComeBackEachOnce) {
  auto dealer = socket(ZMQ_DEALER);
  constexpr std::uint64_t kCount = 500;
  for (std::uint64_t id = 1; id <= kCount; ++id) dealer.send(zmq::buffer(info_bytes(id)));
  std::set<std::uint64_t> ids;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const auto frames = receive_all(dealer);
    ASSERT_EQ(frames.size(), 1u);
    ids.insert(parse(frames[0]).id());
  }
  EXPECT_EQ(ids.size(), kCount);
}

TEST(ServerEndpoints, IpcAndWildcardPorts) {
  const TemporaryFolder folder;
  ServerOptions options = test_options();
  options.transport.bind = "ipc://" + (folder.path() / "requests").string();
  RunningServer server(options);
  EXPECT_EQ(server->request_endpoint(), options.transport.bind);
  EXPECT_EQ(server->stream_endpoint().find("tcp://127.0.0.1:"), 0u);
  EXPECT_EQ(server->stream_endpoint().find('*'), std::string::npos);
  Client client(server->request_endpoint());
  EXPECT_EQ(client.call(info_request()).get_server_info().stream_endpoint(),
            server->stream_endpoint());
}

TEST(ServerEndpoints, ATakenPortIsReported) {
  RunningServer first;
  ServerOptions options = test_options();
  options.transport.bind = first->request_endpoint();
  try {
    const Server second(options);
    FAIL() << "bound twice";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
    EXPECT_EQ(error.field(), "--bind");
    EXPECT_NE(std::string(error.what()).find(options.transport.bind), std::string::npos);
  }
}

}  // namespace
}  // namespace limber::server
