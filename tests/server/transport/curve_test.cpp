#include "server/transport/curve.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/server/support/curve_client.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
namespace fs = std::filesystem;

ServerOptions curve_options(const CurveKeys& server, const AllowedKeys& allowed) {
  ServerOptions options = test_options();
  options.transport.curve = CurveSetup{server, allowed, {}};
  return options;
}

/// What a client with these keys gets within the time.
std::optional<proto::Reply> ask(const std::string& endpoint, const CurveKeys* own,
                                const std::string& server_key, milliseconds time) {
  zmq::context_t context;
  zmq::socket_t socket(context, ZMQ_DEALER);
  socket.set(zmq::sockopt::linger, 0);
  if (own != nullptr) use_keys(socket, *own, server_key);
  socket.connect(endpoint);
  proto::Request request = info_request();
  request.set_version(1);
  socket.send(zmq::buffer(request.SerializeAsString()));
  socket.set(zmq::sockopt::rcvtimeo, static_cast<int>(time.count()));
  zmq::message_t message;
  if (!socket.recv(message)) return std::nullopt;
  proto::Reply reply;
  EXPECT_TRUE(reply.ParseFromArray(message.data(), static_cast<int>(message.size())));
  return reply;
}

TEST(ServerCurve, AllowsKeysOfTheListAndNobodyElse) {
  const CurveKeys server_keys = make_curve_keys(), friend_keys = make_curve_keys(),
                  stranger = make_curve_keys();
  RunningServer server(curve_options(server_keys, {{friend_keys.public_key, {}}}));
  const std::string& endpoint = server->request_endpoint();
  EXPECT_TRUE(ask(endpoint, &friend_keys, server_keys.public_key, milliseconds(10000)).has_value());
  EXPECT_FALSE(ask(endpoint, &stranger, server_keys.public_key, milliseconds(500)).has_value());
  EXPECT_FALSE(ask(endpoint, nullptr, "", milliseconds(500)).has_value());  // no CURVE at all
  EXPECT_FALSE(ask(endpoint, &friend_keys, stranger.public_key, milliseconds(500))
                   .has_value());  // another server's key
  EXPECT_GE(server->counters().refused_handshakes.load(), 1u);
  EXPECT_EQ(server->counters().requests.load(), 1u);
}

TEST(ServerCurve, StreamsAreGuardedToo) {
  const CurveKeys server_keys = make_curve_keys(), friend_keys = make_curve_keys(),
                  stranger = make_curve_keys();
  ServerOptions options = curve_options(server_keys, {{friend_keys.public_key, {}}});
  RunningServer server(std::move(options));
  zmq::context_t context;
  zmq::socket_t client(context, ZMQ_DEALER);
  client.set(zmq::sockopt::linger, 0);
  use_keys(client, friend_keys, server_keys.public_key);
  client.connect(server->request_endpoint());
  const auto heard = [&](const CurveKeys& own) {
    zmq::socket_t sub(context, ZMQ_SUB);
    sub.set(zmq::sockopt::linger, 0);
    use_keys(sub, own, server_keys.public_key);
    sub.set(zmq::sockopt::subscribe, "session/x/status");
    sub.connect(server->stream_endpoint());
    sub.set(zmq::sockopt::rcvtimeo, 1500);
    zmq::message_t message;
    return sub.recv(message).has_value();
  };
  // The status of a session is published on subscription.
  proto::Request request = open_request(small_scene(), "x");
  request.set_version(1);
  client.send(zmq::buffer(request.SerializeAsString()));
  zmq::message_t reply;
  ASSERT_TRUE(client.recv(reply).has_value());
  EXPECT_TRUE(heard(friend_keys));
  EXPECT_FALSE(heard(stranger));
}

TEST(ServerCurve, BeyondLoopbackOnlyWithKeys) {
  ServerOptions options = test_options();
  options.transport.bind = "tcp://0.0.0.0:*";
  try {
    const Server server(options);
    FAIL() << "bound without keys";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.field(), "--bind");
  }
  options = test_options();
  options.transport.stream = "tcp://*:*";
  EXPECT_THROW(Server{options}, Refusal);
  const CurveKeys keys = make_curve_keys(), own = make_curve_keys();
  options = curve_options(keys, {{own.public_key, {}}});
  options.transport.bind = "tcp://0.0.0.0:*";
  RunningServer server(options);
  std::string endpoint = server->request_endpoint();
  endpoint.replace(endpoint.find("0.0.0.0"), 7, "127.0.0.1");
  EXPECT_TRUE(ask(endpoint, &own, keys.public_key, milliseconds(10000)).has_value());
}

TEST(CurveFiles, WrittenKeysAreReadBack) {
  const TemporaryFolder folder;
  const fs::path secret = folder.path() / "server", allow = folder.path() / "allow";
  const CurveKeys keys = make_curve_keys(), one = make_curve_keys(), two = make_curve_keys();
  write_curve_keys(secret, keys);
  std::ofstream(allow) << "# clients\n\n"
                       << one.public_key << "   # the workstation\n  " << two.public_key << "\r\n";
  const CurveSetup setup = read_curve_setup(secret, allow);
  EXPECT_EQ(setup.server.public_key, keys.public_key);
  EXPECT_EQ(setup.server.secret_key, keys.secret_key);
  EXPECT_EQ(setup.allowed, (AllowedKeys{{one.public_key, {}}, {two.public_key, {}}}));
  EXPECT_EQ(fs::status(secret).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THROW(write_curve_keys(secret, keys), Error);  // never overwritten
}

TEST(CurveFiles, TheCommentSignIsADigitOfKeys) {
  const TemporaryFolder folder;
  const fs::path secret = folder.path() / "server", allow = folder.path() / "allow";
  write_curve_keys(secret, make_curve_keys());
  // (A key never starts with it: the first five digits would pass 2^32.)
  const std::string key = "ab#cd" + std::string(35, '0');
  std::ofstream(allow) << key << "\n#" << std::string(39, '0') << "\n";
  EXPECT_EQ(read_curve_setup(secret, allow).allowed, (AllowedKeys{{key, {}}}));
}

TEST(CurveFiles, BadFilesAreRefused) {
  const TemporaryFolder folder;
  const fs::path secret = folder.path() / "server", allow = folder.path() / "allow";
  EXPECT_THROW((void)read_curve_setup(secret, allow), Error);
  write_curve_keys(secret, make_curve_keys());
  EXPECT_THROW((void)read_curve_setup(secret, allow), Error);
  std::ofstream(allow) << "too short\n";
  EXPECT_THROW((void)read_curve_setup(secret, allow), Error);
  std::ofstream(allow) << "";
  EXPECT_NO_THROW((void)read_curve_setup(secret, allow));
  fs::permissions(secret, fs::perms::group_read, fs::perm_options::add);
  EXPECT_THROW((void)read_curve_setup(secret, allow), Error);
}

}  // namespace
}  // namespace limber::server
