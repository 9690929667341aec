// Long replies in parts (parts.proto).
#include "server/runtime/reply_parts.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "server/wire/errors.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct KeptReplyParts : ::testing::Test {
  proto::GetReplyPartResponse begin(const std::string& client, std::uint64_t most_bytes) {
    UnreadReplies::Excess excess;
    return parts.begin(client, reply, *unread.admit(client, reply.size(), excess), most_bytes, now);
  }
  proto::GetReplyPartResponse part(const std::string& client, std::uint64_t number,
                                   std::uint64_t offset, std::uint64_t most_bytes) {
    proto::GetReplyPartRequest wanted;
    wanted.set_reply(number);
    wanted.set_offset(offset);
    wanted.set_most_bytes(most_bytes);
    return parts.part(client, wanted, now);
  }
  std::string reply = "0123456789";
  UnreadReplies unread{{1 << 30, 1u << 31}};
  ReplyParts parts;
  ReplyParts::Clock::time_point now{};
};

TEST_F(KeptReplyParts, GoWithTheLastOneAndCountAsUnreadUntilThen) {
  const auto first = begin("a", 4);
  EXPECT_EQ(first.data(), "0123");
  EXPECT_EQ(first.total_bytes(), 10u);
  const auto second = part("a", first.reply(), 4, 5);
  EXPECT_EQ(second.data(), "45678");
  EXPECT_EQ(second.offset(), 4u);
  EXPECT_EQ(part("a", first.reply(), 4, 3).data(), "456");  // again, as it may be sent again
  EXPECT_GE(unread.total(), 10u);
  EXPECT_EQ(part("a", first.reply(), 9, 100).data(), "9");
  EXPECT_EQ(unread.total(), 0u);
  EXPECT_THROW((void)part("a", first.reply(), 9, 1), Error);
}

TEST_F(KeptReplyParts, AreForTheConnectionThatAsked) {
  const auto first = begin("a", 4), other = begin("b", 4);
  EXPECT_NE(first.reply(), other.reply());
  EXPECT_THROW((void)part("b", first.reply(), 4, 4), Error);
  parts.drop("b");
  EXPECT_THROW((void)part("b", other.reply(), 4, 4), Error);
  EXPECT_EQ(part("a", first.reply(), 4, 4).data(), "4567");
  EXPECT_EQ(parts.size(), 1u);
}

TEST_F(KeptReplyParts, AreRefusedBeyondTheEndAndWithoutBytes) {
  const auto first = begin("a", 4);
  for (const std::uint64_t offset : {std::uint64_t{10}, ~std::uint64_t{0}})
    EXPECT_THROW((void)part("a", first.reply(), offset, 4), Refusal);
  EXPECT_THROW((void)part("a", first.reply(), 4, 0), Refusal);
  EXPECT_EQ(part("a", first.reply(), 4, ~std::uint64_t{0}).data(), "456789");
}

TEST_F(KeptReplyParts, AreSixteenOfAConnectionTheNewestOnes) {
  const auto first = begin("a", 4), other = begin("b", 4);
  for (std::size_t i = 1; i < ReplyParts::kMostOfClient; ++i) (void)begin("a", 4);
  EXPECT_EQ(part("a", first.reply(), 4, 4).data(), "4567");
  const auto last = begin("a", 4);
  EXPECT_THROW((void)part("a", first.reply(), 4, 4), Error);
  EXPECT_EQ(part("a", last.reply(), 4, 4).data(), "4567");
  EXPECT_EQ(part("b", other.reply(), 4, 4).data(), "4567");
  EXPECT_EQ(parts.size(), ReplyParts::kMostOfClient + 1);
}

TEST_F(KeptReplyParts, HaveAMebibyteAtMost) {
  reply.assign(ReplyParts::kMostBytes + 10, 'x');
  const auto first = begin("a", ~std::uint64_t{0});
  EXPECT_EQ(first.data().size(), ReplyParts::kMostBytes);
  EXPECT_EQ(part("a", first.reply(), 0, ~std::uint64_t{0}).data().size(), ReplyParts::kMostBytes);
  EXPECT_EQ(part("a", first.reply(), ReplyParts::kMostBytes, 100).data().size(), 10u);
  EXPECT_EQ(parts.size(), 0u);
}

TEST_F(KeptReplyParts, GoWhereNobodyAsksForAMinute) {
  const auto first = begin("a", 4);
  now += ReplyParts::kPatience;
  parts.sweep(now);
  (void)part("a", first.reply(), 4, 1);
  now += ReplyParts::kPatience;
  parts.sweep(now);
  EXPECT_EQ(parts.size(), 1u);
  now += std::chrono::seconds(1);
  parts.sweep(now);
  EXPECT_EQ(parts.size(), 0u);
  EXPECT_EQ(unread.total(), 0u);
}

struct ServerReplyParts : ::testing::Test {
  void SetUp() override { open_and_solve(client, "s"); }
  static proto::Request geometry(std::uint64_t most_reply_bytes) {
    proto::Request request;
    request.set_most_reply_bytes(most_reply_bytes);
    request.mutable_get_geometry()->set_session("s");
    return request;
  }
  static proto::Request part(std::uint64_t reply, std::uint64_t offset, std::uint64_t most_bytes) {
    proto::Request request;
    auto& wanted = *request.mutable_get_reply_part();
    wanted.set_reply(reply);
    wanted.set_offset(offset);
    wanted.set_most_bytes(most_bytes);
    return request;
  }
  std::uint64_t unread() {
    return client.call(info_request()).get_server_info().counters().at("unread_bytes");
  }
  RunningServer server;
  Client client{server->request_endpoint()};
};

TEST_F(ServerReplyParts, AreTheWholeThoughEditsGoOn) {
  const auto whole = client.call(geometry(0));
  ASSERT_TRUE(whole.has_get_geometry());
  EXPECT_TRUE(client.call(geometry(whole.ByteSizeLong() + 1000)).has_get_geometry());
  const auto first = client.call(geometry(100)).get_reply_part();
  ASSERT_EQ(first.data().size(), 100u);
  std::string bytes = first.data();
  int parts = 1;
  for (; bytes.size() < first.total_bytes(); ++parts) {
    ASSERT_TRUE(client.call(move_request("s", 1, 0, 0.001 * parts, 0)).has_edit());
    const auto next = client.call(part(first.reply(), bytes.size(), 500)).get_reply_part();
    ASSERT_EQ(next.offset(), bytes.size());
    ASSERT_FALSE(next.data().empty());
    bytes += next.data();
  }
  EXPECT_GT(parts, 3);
  proto::Reply joined;
  ASSERT_TRUE(joined.ParseFromString(bytes));
  EXPECT_EQ(joined.get_geometry().SerializeAsString(), whole.get_geometry().SerializeAsString());
  const auto gone = client.call(part(first.reply(), 0, 500));
  EXPECT_EQ(gone.error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(gone.error().field(), "reply");
}

TEST_F(ServerReplyParts, AreForTheConnectionThatAskedAndGoWithIt) {
  std::uint64_t number = 0;
  {
    Client other(server->request_endpoint());
    number = other.call(geometry(100)).get_reply_part().reply();
    EXPECT_EQ(client.call(part(number, 100, 500)).error().field(), "reply");
    EXPECT_GT(unread(), 1000u);
  }
  for (int i = 0; i < 500 && unread() > 1000; ++i) std::this_thread::sleep_for(milliseconds(20));
  EXPECT_LT(unread(), 1000u);
}

TEST_F(ServerReplyParts, ComeWholeWhereThereIsNoRoomToKeepThem) {
  ServerOptions options = test_options();
  options.transport.unread_bytes = 3000;
  RunningServer narrow(options);
  Client reader(narrow->request_endpoint());
  open_and_solve(reader, "s");
  ASSERT_GT(client.call(geometry(0)).ByteSizeLong(), 1500u);
  EXPECT_TRUE(reader.call(geometry(100)).has_get_geometry());
  EXPECT_TRUE(reader.call(move_request("s", 1, 0, 0.1, 0)).has_edit());
}

TEST_F(ServerReplyParts, AreNotOfRepliesThatAreKeptForRepetitionsNorOfErrors) {
  auto edit = move_request("s", 1, 0, 0.1, 0);
  edit.set_most_reply_bytes(1);
  EXPECT_TRUE(client.call(edit).has_edit());
  const auto first = client.call(geometry(100)).get_reply_part();
  auto next = part(first.reply(), 100, 200);
  next.set_most_reply_bytes(1);
  EXPECT_EQ(client.call(next).get_reply_part().data().size(), 200u);
  auto unknown = geometry(1);
  unknown.mutable_get_geometry()->set_session("nobody");
  EXPECT_TRUE(client.call(unknown).has_error());
}

}  // namespace
}  // namespace limber::server
