#include "server/runtime/stored_replies.h"

#include <gtest/gtest.h>

#include "server/runtime/ticket.h"
#include "server/wire/errors.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using Verdict = StoredReplies::Verdict;
using std::chrono::seconds;

struct ServerStoredReplies : ::testing::Test {
  SharedTicket ticket(const std::string& connection) {
    return std::make_shared<Ticket>(transport, counters, open, Address{{connection}, 0}, 1);
  }
  Verdict begin(const RequestKey& key, const std::string& content = "x") {
    const auto its = ticket("connection");
    const auto verdict = replies.begin(key, content_hash(content), its, now).verdict;
    its->absorb();
    return verdict;
  }
  void apply(const RequestKey& key, const std::string& reply) {
    ASSERT_EQ(begin(key), Verdict::kNew);
    EXPECT_EQ(replies.answer(key, reply, now), nullptr);
  }

  Counters counters;
  Transport transport{test_options().transport, counters};
  OpenRequests open;
  StoredReplies::Clock::time_point now{};
  StoredReplies replies{
      {.client_replies = 4, .client_bytes = 10'000, .total_bytes = 30'000, .age = seconds(60)}};
};

TEST_F(ServerStoredReplies, ARepetitionGetsTheReplyOfTheFirst) {
  apply({"a", 1}, "done");
  const auto its = ticket("another connection");
  const auto finding = replies.begin({"a", 1}, content_hash("x"), its, now);
  EXPECT_EQ(finding.verdict, Verdict::kAnswered);
  EXPECT_EQ(finding.reply, "done");
  its->absorb();
  EXPECT_EQ(begin({"b", 1}), Verdict::kNew);
}

TEST_F(ServerStoredReplies, OtherBytesUnderAnIdAreNoRepetition) {
  apply({"a", 1}, "done");
  EXPECT_EQ(begin({"a", 1}, "y"), Verdict::kDifferent);
  std::string large(6 << 20, 'x'), other = large;
  other.back() = 'y';
  EXPECT_NE(content_hash(large), content_hash(other));
  EXPECT_NE(content_hash(large), content_hash(large + 'x'));
}

TEST_F(ServerStoredReplies, RepliesOfAClientAreBoundedInNumberAndBytes) {
  for (std::uint64_t id = 1; id <= 1000; ++id) apply({"a", id}, "done");
  EXPECT_EQ(replies.size(), 4u);
  EXPECT_EQ(begin({"a", 1000}), Verdict::kAnswered);
  for (std::uint64_t id = 1001; id <= 1100; ++id) apply({"a", id}, std::string(4000, 'r'));
  EXPECT_LE(replies.bytes(), 10'000u);
  EXPECT_EQ(begin({"a", 1100}), Verdict::kAnswered);
}

TEST_F(ServerStoredReplies, RepliesOfAllClientsAreBoundedAndTheOldestGoFirst) {
  for (int client = 0; client < 500; ++client)
    apply({"client " + std::to_string(client), 1}, std::string(1000, 'r'));
  EXPECT_LE(replies.bytes(), 30'000u);
  EXPECT_GT(replies.size(), 10u);
  EXPECT_EQ(begin({"client 499", 1}), Verdict::kAnswered);
  EXPECT_EQ(begin({"client 0", 1}), Verdict::kNew);
}

TEST_F(ServerStoredReplies, RepliesExpire) {
  apply({"a", 1}, "done");
  now += seconds(59);
  EXPECT_EQ(begin({"a", 1}), Verdict::kAnswered);
  now += seconds(1);
  EXPECT_EQ(begin({"b", 1}), Verdict::kNew);
  EXPECT_EQ(replies.bytes(), 0u);
  EXPECT_EQ(begin({"a", 1}), Verdict::kNew);
}

TEST_F(ServerStoredReplies, AReplyTooLargeToKeepIsStillNoReasonToApplyTwice) {
  apply({"a", 1}, std::string(20'000, 'r'));
  EXPECT_LE(replies.bytes(), 10'000u);
  EXPECT_EQ(begin({"a", 1}), Verdict::kTooLarge);
}

TEST_F(ServerStoredReplies, WhatIsInProgressIsAnsweredOnTheNewestConnectionToo) {
  const auto first = ticket("first"), second = ticket("second"), third = ticket("third");
  const auto hash = content_hash("x");
  EXPECT_EQ(replies.begin({"a", 1}, hash, first, now).verdict, Verdict::kNew);
  const auto same = ticket("first");
  EXPECT_EQ(replies.begin({"a", 1}, hash, same, now).verdict, Verdict::kRunning);
  EXPECT_TRUE(same->answered());  // the reply to the first is the reply to it
  EXPECT_EQ(replies.begin({"a", 1}, hash, second, now).verdict, Verdict::kRunning);
  EXPECT_EQ(replies.begin({"a", 1}, hash, third, now).verdict, Verdict::kRunning);
  EXPECT_TRUE(second->answered());
  // One that the third has overtaken takes nothing from it.
  const auto late = ticket("first");
  EXPECT_EQ(replies.begin({"a", 1}, hash, late, now).verdict, Verdict::kRunning);
  EXPECT_TRUE(late->answered());
  EXPECT_EQ(replies.answer({"a", 1}, "done", now), third);
  EXPECT_FALSE(third->answered());
  for (const auto& its : {first, third}) its->absorb();
  EXPECT_EQ(open.total(), 0u);
}

TEST_F(ServerStoredReplies, ARequestOfAClientThatIsGoneBelongsToItsRepetition) {
  const auto first = ticket("first"), second = ticket("second");
  const auto hash = content_hash("x");
  EXPECT_EQ(replies.begin({"a", 1}, hash, first, now).verdict, Verdict::kNew);
  first->keep_reply(replies, {"a", 1}, 0);
  EXPECT_EQ(replies.begin({"a", 1}, hash, second, now).verdict, Verdict::kRunning);
  EXPECT_EQ(first->abandon(), second);
  second->answer({});
  EXPECT_EQ(begin({"a", 1}), Verdict::kAnswered);
  const auto alone = ticket("first");
  EXPECT_EQ(replies.begin({"a", 2}, hash, alone, now).verdict, Verdict::kNew);
  alone->keep_reply(replies, {"a", 2}, 0);
  EXPECT_EQ(alone->abandon(), nullptr);
  EXPECT_EQ(begin({"a", 2}), Verdict::kNew);
}

TEST_F(ServerStoredReplies, RefusalsBeforeTheWorkBeganAreNotKept) {
  const auto first = ticket("first"), second = ticket("second");
  const auto hash = content_hash("x");
  EXPECT_EQ(replies.begin({"a", 1}, hash, first, now).verdict, Verdict::kNew);
  first->keep_reply(replies, {"a", 1}, 0);
  EXPECT_EQ(replies.begin({"a", 1}, hash, second, now).verdict, Verdict::kRunning);
  EXPECT_TRUE(first->refuse_unbegun(limit_exceeded("body", "requests", 1, 2)));
  EXPECT_TRUE(second->answered());  // by the same refusal
  EXPECT_EQ(replies.size(), 0u);
  EXPECT_EQ(open.total(), 0u);
  const auto again = ticket("first");
  EXPECT_EQ(replies.begin({"a", 1}, hash, again, now).verdict, Verdict::kNew);
  again->keep_reply(replies, {"a", 1}, 0);
  again->refuse(limit_exceeded("edits", "constraints", 1, 2));  // by the work itself
  EXPECT_EQ(begin({"a", 1}), Verdict::kAnswered);
}

}  // namespace
}  // namespace limber::server
