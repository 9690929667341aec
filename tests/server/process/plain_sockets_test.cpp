#include "tests/server/support/plain_socket.h"

#include "tests/server/process/child_process.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerPlainSockets : ::testing::Test {
  TemporaryFolder folder;
  static constexpr milliseconds kQuiet{1000};

  static std::string bytes_of_request(proto::Request request) {
    request.set_version(1);
    request.set_id(7);
    return request.SerializeAsString();
  }
  static std::string shutdown_bytes() {
    proto::Request request;
    request.mutable_shutdown();
    return bytes_of_request(request);
  }
  /// The server is there and has heard no request but those of this client.
  static void expect_untouched(Daemon& daemon) {
    Client client(daemon.requests);
    const auto reply = client.call(info_request());
    ASSERT_TRUE(reply.has_get_server_info());
    EXPECT_EQ(reply.get_server_info().counters().at("requests"), 1u);
    EXPECT_FALSE(daemon.process().wait(milliseconds(0)).has_value());
  }
};

TEST_F(ServerPlainSockets, AWebPageCannotStopTheServer) {
  // Shutdown is allowed: it is the connection that is refused.
  Daemon daemon(folder.path(), {"--allow-shutdown"});
  const PlainSocket page(daemon.requests);
  page.send(web_page_request(shutdown_bytes()));
  EXPECT_TRUE(page.receive_all(kQuiet).closed);
  expect_untouched(daemon);
}

TEST_F(ServerPlainSockets, Zmtp1PeersAreNotAnswered) {
  Daemon daemon(folder.path(), {"--allow-shutdown"});
  const PlainSocket peer(daemon.requests);
  peer.send(zmtp1_frame("") + zmtp1_frame(bytes_of_request(info_request())));
  const auto received = peer.receive_all(kQuiet);
  EXPECT_TRUE(received.closed);
  EXPECT_LT(received.bytes.size(), 64u);  // no more than a greeting
  expect_untouched(daemon);
}

TEST_F(ServerPlainSockets, Zmtp2PeersAreNotAnswered) {
  Daemon daemon(folder.path(), {"--allow-shutdown"});
  const PlainSocket peer(daemon.requests);
  // Signature, revision 1 (ZMTP 2.0), DEALER; an empty routing id; the message.
  const std::string message = bytes_of_request(info_request());
  peer.send("\xff" + std::string(8, '\0') + "\x7f\x01\x05" + std::string(2, '\0') +
            std::string(1, '\0') + static_cast<char>(message.size()) + message);
  const auto received = peer.receive_all(kQuiet);
  EXPECT_TRUE(received.closed);
  EXPECT_LT(received.bytes.size(), 64u);
  expect_untouched(daemon);
}

TEST_F(ServerPlainSockets, AWebPageHearsNoStream) {
  Daemon daemon(folder.path());
  // Old peers have no subscriptions: libzmq would send them everything.
  const PlainSocket page(daemon.stream), old(daemon.stream);
  page.send(web_page_request(std::string("\x01", 1)));
  old.send(zmtp1_frame(""));
  Client client(daemon.requests);
  open_and_solve(client, "s");
  for (const auto* peer : {&page, &old}) {
    const auto received = peer->receive_all(kQuiet);
    EXPECT_TRUE(received.closed);
    EXPECT_LT(received.bytes.size(), 64u);
  }
  EXPECT_EQ(client.call(info_request()).get_server_info().counters().at("published"), 0u);
}

}  // namespace
}  // namespace limber::server
