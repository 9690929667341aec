// Real sockets: what changes something is applied once, however often its request comes.
#include <gtest/gtest.h>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerRepeatedRequests : ::testing::Test {
  static std::string bytes_of(proto::Request request, std::uint64_t id,
                              const std::string& name = "") {
    request.set_version(1);
    request.set_id(id);
    request.set_client(name);
    return request.SerializeAsString();
  }
  /// Sent as it is, and the next reply.
  static proto::Reply ask(Client& client, const std::string& bytes) {
    client.send_bytes(bytes);
    auto reply = client.receive();
    EXPECT_TRUE(reply);
    return reply.value_or(proto::Reply());
  }
  static proto::Request add_request(const std::string& session) {
    proto::Request request;
    request.mutable_edit()->set_session(session);
    auto* constraint = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
    constraint->set_frame(5);
    constraint->add_nodes(27);
    constraint->mutable_displacement()->set_y(0.01);
    return request;
  }
  proto::SessionStatus status(const std::string& session) {
    proto::Request request;
    request.mutable_get_session()->set_session(session);
    return client.call(request).get_session().status();
  }
  std::uint64_t counter(const char* name) {
    return client.call(info_request()).get_server_info().counters().at(name);
  }

  RunningServer server;
  Client client{server->request_endpoint()}, other{server->request_endpoint()};
};

TEST_F(ServerRepeatedRequests, ARepeatedEditIsAppliedOnceAndAnsweredTwice) {
  open_and_solve(client, "s");
  const auto before = status("s").constraints();
  const std::string edit = bytes_of(add_request("s"), 1'000'001);
  const auto first = ask(client, edit), second = ask(client, edit);
  ASSERT_TRUE(first.has_edit()) << first.ShortDebugString();
  EXPECT_EQ(first.SerializeAsString(), second.SerializeAsString());
  EXPECT_EQ(first.id(), 1'000'001u);
  EXPECT_EQ(status("s").constraints(), before + 1);
  EXPECT_EQ(status("s").revision(), 1u);
  EXPECT_EQ(counter("repeated_requests"), 1u);
}

TEST_F(ServerRepeatedRequests, ARepeatedEditThatWasRefusedIsRefusedAgain) {
  open_and_solve(client, "s");
  auto request = add_request("s");
  request.mutable_edit()->set_expected_revision(1);
  const std::string edit = bytes_of(request, 1'000'001);
  EXPECT_EQ(ask(client, edit).error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  ASSERT_TRUE(ask(client, bytes_of(add_request("s"), 1'000'002)).has_edit());
  // It would be accepted by now.
  EXPECT_EQ(ask(client, edit).error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(status("s").revision(), 1u);
}

TEST_F(ServerRepeatedRequests, AnotherRequestUnderAUsedIdIsRefused) {
  open_and_solve(client, "s");
  ASSERT_TRUE(ask(client, bytes_of(add_request("s"), 1'000'001)).has_edit());
  proto::Request undo;
  undo.mutable_edit()->set_session("s");
  undo.mutable_edit()->add_edits()->mutable_undo();
  const auto refused = ask(client, bytes_of(undo, 1'000'001));
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(refused.error().field(), "id");
  EXPECT_NE(refused.error().message().find("1000001 was used for another request"),
            std::string::npos)
      << refused.error().message();
  EXPECT_EQ(status("s").revision(), 1u);
}

TEST_F(ServerRepeatedRequests, AnIdOfZeroIsNeverARepetition) {
  open_and_solve(client, "s");
  const std::string edit = bytes_of(add_request("s"), 0);
  EXPECT_EQ(ask(client, edit).edit().revision(), 1u);
  EXPECT_EQ(ask(client, edit).edit().revision(), 2u);
}

TEST_F(ServerRepeatedRequests, IdsBelongToTheConnectionUnlessTheClientNamesItself) {
  open_and_solve(client, "s");
  const std::string unnamed = bytes_of(add_request("s"), 1'000'001);
  EXPECT_EQ(ask(client, unnamed).edit().revision(), 1u);
  EXPECT_EQ(ask(other, unnamed).edit().revision(), 2u);
  const std::string named = bytes_of(add_request("s"), 7, "0123456789abcdef");
  EXPECT_EQ(ask(client, named).edit().revision(), 3u);
  EXPECT_EQ(ask(other, named).edit().revision(), 3u);  // as after a reconnect
  EXPECT_EQ(status("s").revision(), 3u);
  EXPECT_EQ(ask(client, bytes_of(add_request("s"), 7, "another client")).edit().revision(), 4u);
}

TEST_F(ServerRepeatedRequests, ReadsAreAnsweredAnewUnderTheSameId) {
  open_and_solve(client, "s");
  proto::Request read;
  read.mutable_get_session()->set_session("s");
  const std::string bytes = bytes_of(read, 1'000'001);
  EXPECT_EQ(ask(other, bytes).get_session().status().revision(), 0u);
  ASSERT_TRUE(client.call(add_request("s")).has_edit());
  EXPECT_EQ(ask(other, bytes).get_session().status().revision(), 1u);
}

TEST_F(ServerRepeatedRequests, AnOpeningRepeatedWhileItRunsOpensOneSession) {
  // The request pool has three threads: these keep them busy, so that the opening has to wait.
  for (int i = 0; i < 6; ++i) client.send(open_request(small_scene(), "busy" + std::to_string(i)));
  const std::string open = bytes_of(open_request(small_scene()), 1'000'001, "an opening client");
  other.send_bytes(open);
  other.send_bytes(open);
  Client reconnected(server->request_endpoint());
  reconnected.send_bytes(open);
  const auto first = other.receive(), elsewhere = reconnected.receive();
  ASSERT_TRUE(first && elsewhere);
  ASSERT_TRUE(first->has_open_session()) << first->ShortDebugString();
  EXPECT_EQ(first->open_session().uid(), elsewhere->open_session().uid());
  EXPECT_EQ(first->open_session().session(), elsewhere->open_session().session());
  for (int i = 0; i < 6; ++i) ASSERT_TRUE(client.receive());
  proto::Request list;
  list.mutable_list_sessions();
  EXPECT_EQ(client.call(list).list_sessions().sessions_size(), 7);
}

TEST_F(ServerRepeatedRequests, ClientNamesThatAreTooLongAreRefused) {
  const auto reply = ask(client, bytes_of(info_request(), 1, std::string(65, 'c')));
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_MALFORMED);
  EXPECT_NE(reply.error().message().find("client: 65 bytes"), std::string::npos);
}

}  // namespace
}  // namespace limber::server
