// A gateway in this process: what may run at once, for ThreadSanitizer too.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/server/support/page.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

web::Options any_port() {
  web::Options options;
  options.address = "127.0.0.1:0";
  return options;
}

struct Gateway : ::testing::Test {
  RunningServer server{test_options(), any_port()};
  Client client{server->request_endpoint()};
};

proto::Request list_sessions() {
  proto::Request request;
  request.mutable_list_sessions();
  return request;
}

TEST_F(Gateway, EditsOfOthersReachPages) {
  open_and_solve(client, "s");
  const Page stream(server->web(), "/v1/stream");
  stream.send("\x01session/s/body/0/coordinates");
  std::uint64_t revision = 0;
  for (const std::uint64_t wanted : {0, 1, 2, 3}) {
    if (wanted > 0) {
      ASSERT_TRUE(
          client.call(move_request("s", 1, 0, 0.01 * static_cast<double>(wanted), 0)).has_edit());
    }
    while (revision < wanted || wanted == 0) {
      const auto frame = stream.receive();
      ASSERT_TRUE(frame && frame->kind == 2);
      const auto length = static_cast<std::size_t>(frame->bytes.front());
      EXPECT_EQ(frame->bytes.substr(1, length), "session/s/body/0/coordinates");
      proto::StreamMessage message;
      ASSERT_TRUE(message.ParseFromString(frame->bytes.substr(1 + length)));
      revision = message.frames().result().revision();
      if (wanted == 0) break;
    }
  }
}

TEST_F(Gateway, PagesComeAndGoWhileOthersWork) {
  open_and_solve(client, "s");
  std::atomic<int> answered{0};
  std::vector<std::thread> visitors;
  for (int i = 0; i < 4; ++i) {
    visitors.emplace_back([&, i] {
      for (int round = 0; round < 8; ++round) {
        Page requests(server->web(), "/v1/requests");
        const Page stream(server->web(), "/v1/stream");
        stream.send("\x01session/");
        for (int n = 0; n < 100; ++n) requests.ask(list_sessions());
        for (int n = 0; n < (round % 2 == 0 ? 100 : 10 * i); ++n) {
          if (requests.reply().has_list_sessions()) ++answered;
        }
      }
    });
  }
  for (int revision = 1; revision <= 20; ++revision)
    ASSERT_TRUE(client.call(move_request("s", 1, 0, 0.01 * revision, 0)).has_edit());
  for (auto& visitor : visitors) visitor.join();
  EXPECT_EQ(answered.load(), 4 * 4 * 100 + 4 * 10 * (0 + 1 + 2 + 3));
}

TEST_F(Gateway, TheEndFindsPagesInEveryState) {
  open_and_solve(client, "s");
  const Page idle(server->web(), "/v1/requests");
  const Page stream(server->web(), "/v1/stream");
  stream.send("\x01");
  Page waiting(server->web(), "/v1/requests");
  const std::uint64_t wait = waiting.ask(wait_request("s", 99));
  waiting.ask(list_sessions());
  EXPECT_TRUE(waiting.reply().has_list_sessions());
  const PlainSocket half(server->web().url);
  half.send("GET / HTTP/1.1\r\n");
  EXPECT_EQ(server.stop(), Server::Ending::kClean);
  const proto::Reply refused = waiting.reply();
  EXPECT_EQ(refused.id(), wait);
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_SHUTTING_DOWN);
  const auto end = waiting.receive();
  ASSERT_TRUE(end && end->kind == 8);
  EXPECT_EQ(end->bytes, "\x03\xe9limberd stops");  // 1001
  EXPECT_EQ(idle.receive()->kind, 8);
}

TEST_F(Gateway, TheTokenIsToldByTheSocketAlone) {
  proto::Request request;
  request.mutable_get_server_info();
  const auto of_socket = client.call(request).get_server_info();
  EXPECT_EQ(of_socket.web(), server->web().url);
  EXPECT_EQ(of_socket.web_token(), server->web().token);
  Page page(server->web(), "/v1/requests");
  page.ask(request);
  const auto of_page = page.reply().get_server_info();
  EXPECT_EQ(of_page.web(), server->web().url);
  EXPECT_EQ(of_page.web_token(), "");
}

}  // namespace
}  // namespace limber::server
