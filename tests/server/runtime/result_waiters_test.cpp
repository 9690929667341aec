#include "server/runtime/result_waiters.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using Check = ResultWaiters::Check;
using Later = ResultWaiters::Later;
using Storing = ResultWaiters::Storing;
using Until = ResultWaiters::Until;

struct ServerResultWaiters : ::testing::Test {
  Counters counters;
  Transport transport{test_options().transport, counters};
  OpenRequests open;
  boost::asio::io_context control{1};
  StoredReplies replies{{.client_replies = 100,
                         .client_bytes = 100'000,
                         .total_bytes = 1'000'000,
                         .age = std::chrono::seconds(60)}};
  ResultWaiters waiters{control};
  std::uint64_t last = 0, sequence = 0;

  /// A request whose reply is kept, so that it can be read.
  struct Asked {
    RequestKey key;
    SharedTicket ticket;
  };
  Asked ask(std::uint64_t revision, Until until, double timeout_s = 1000,
            const std::string& client = "a") {
    Asked asked{{client, ++last}, new_ticket(client)};
    (void)replies.begin(asked.key, 1, asked.ticket, {});
    asked.ticket->keep_reply(replies, asked.key, 0);
    waiters.wait(revision, until, timeout_s, asked.ticket);
    return asked;
  }
  SharedTicket new_ticket(const std::string& client) {
    return std::make_shared<Ticket>(transport, counters, open, Address{{client}, 0}, 1);
  }
  proto::Reply reply_to(const Asked& asked) {
    const auto again = new_ticket("another connection");
    const auto finding = replies.begin(asked.key, 1, again, {});
    again->absorb();
    proto::Reply reply;
    EXPECT_TRUE(reply.ParseFromString(finding.reply));
    return reply;
  }
  /// The revision of its result; 0: it is not answered.
  std::uint64_t answered_with(const Asked& asked) {
    return asked.ticket->answered() ? reply_to(asked).wait().result().revision() : 0;
  }
  std::shared_ptr<const proto::ResultInfo> note(std::uint64_t revision, bool converged,
                                                Check check = Check::kDone,
                                                Storing storing = Storing::kDone) {
    const auto result = std::make_shared<proto::ResultInfo>();
    result->set_revision(revision);
    result->set_sequence(++sequence);
    result->set_converged(converged);
    waiters.note(result, check, storing);
    return result;
  }
  ~ServerResultWaiters() override {
    waiters.refuse_all(Error(ErrorCode::kCancelled, "", "the test ends"), Later::kRefuse);
    control.poll();
  }
};

TEST_F(ServerResultWaiters, EachIsAnsweredByTheFirstResultThatWillDo) {
  const auto first = ask(3, Until::kFirst), final = ask(3, Until::kFinal),
             checked = ask(3, Until::kChecked);
  note(2, true);
  EXPECT_EQ(waiters.size(), 3u);  // an older revision
  note(3, false);
  EXPECT_EQ(answered_with(first), 3u);
  EXPECT_EQ(answered_with(final), 0u);
  note(4, true, Check::kPending);
  EXPECT_EQ(answered_with(first), 3u);
  EXPECT_EQ(answered_with(final), 4u);
  EXPECT_EQ(answered_with(checked), 0u);
  note(4, true, Check::kDone);
  EXPECT_EQ(answered_with(checked), 4u);
  EXPECT_EQ(waiters.size(), 0u);
}

TEST_F(ServerResultWaiters, WhoComesLaterIsAnsweredAtOnce) {
  note(3, true, Check::kDone);
  note(4, true, Check::kPending);
  note(5, false);
  EXPECT_EQ(answered_with(ask(0, Until::kFirst)), 5u);
  EXPECT_EQ(answered_with(ask(4, Until::kFinal)), 4u);
  EXPECT_EQ(answered_with(ask(3, Until::kChecked)), 3u);
  EXPECT_EQ(waiters.size(), 0u);
  EXPECT_EQ(answered_with(ask(5, Until::kFinal)), 0u);
  EXPECT_EQ(answered_with(ask(4, Until::kChecked)), 0u);
  EXPECT_EQ(answered_with(ask(6, Until::kFirst)), 0u);
  EXPECT_EQ(waiters.size(), 3u);
}

TEST_F(ServerResultWaiters, AFinalResultIsToldOnceItIsStored) {
  const auto first = ask(3, Until::kFirst), final = ask(3, Until::kFinal),
             checked = ask(3, Until::kChecked);
  const auto pending = note(3, true, Check::kDone, Storing::kPending);
  EXPECT_EQ(answered_with(first), 3u) << "its frames are shown already";
  const auto late = ask(3, Until::kFinal);
  EXPECT_EQ(waiters.size(), 3u);
  note(4, false);
  waiters.note(pending, Check::kDone);
  for (const auto& asked : {final, checked, late}) EXPECT_EQ(answered_with(asked), 3u);
  EXPECT_EQ(answered_with(ask(0, Until::kFirst)), 4u) << "it is not the newest one for that";
  EXPECT_EQ(answered_with(ask(3, Until::kFinal)), 3u);
}

TEST_F(ServerResultWaiters, OneThatIsStoredBehindANewerOneIsNotTheNewest) {
  const auto older = note(3, true, Check::kDone, Storing::kPending);
  note(4, true);
  waiters.note(older, Check::kDone);
  EXPECT_EQ(answered_with(ask(4, Until::kChecked)), 4u);
}

TEST_F(ServerResultWaiters, ThoseWhoWaitTooLongAreToldSo) {
  const auto soon = ask(1, Until::kFinal, 0), later = ask(1, Until::kFinal);
  control.run_one_for(std::chrono::seconds(60));
  ASSERT_TRUE(soon.ticket->answered());
  const proto::Reply reply = reply_to(soon);
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_TIMEOUT);
  EXPECT_EQ(reply.error().field(), "timeout_s");
  EXPECT_EQ(counters.errors.load(), 0U) << "a slice of a wait is no error";
  EXPECT_FALSE(later.ticket->answered());
  EXPECT_EQ(waiters.size(), 1u);
}

TEST_F(ServerResultWaiters, RefusalsReachThoseWhoWaitAndOnDemandThoseWhoCome) {
  const auto waiting = ask(1, Until::kFirst);
  const Error fault(ErrorCode::kFailedPrecondition, "session", "no model");
  waiters.refuse_all(fault, Later::kAccept);
  EXPECT_EQ(reply_to(waiting).error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(waiters.size(), 0u);
  EXPECT_FALSE(ask(1, Until::kFirst).ticket->answered());

  waiters.refuse_all(fault, Later::kRefuse);
  const auto refused = ask(1, Until::kFirst);
  ASSERT_TRUE(refused.ticket->answered());
  EXPECT_EQ(reply_to(refused).error().message(), "no model");
  waiters.accept();
  EXPECT_FALSE(ask(1, Until::kFirst).ticket->answered());
}

TEST_F(ServerResultWaiters, ResultsThatAreThereAreGivenInSpiteOfRefusals) {
  note(2, true);
  waiters.refuse_all(Error(ErrorCode::kCancelled, "", "closed"), Later::kRefuse);
  EXPECT_EQ(answered_with(ask(2, Until::kChecked)), 2u);
  EXPECT_EQ(reply_to(ask(3, Until::kFirst)).error().code(), proto::ERROR_CODE_CANCELLED);
}

TEST_F(ServerResultWaiters, OfAClientThatIsGoneNobodyWaits) {
  const auto gone = ask(1, Until::kFirst, 1000, "gone"), here = ask(1, Until::kFirst, 1000, "here");
  waiters.abandon("gone");
  EXPECT_EQ(waiters.size(), 1u);
  EXPECT_TRUE(gone.ticket->answered());  // nothing will be sent
  EXPECT_EQ(counters.dropped_replies.load(), 1u);
  note(1, false);
  EXPECT_EQ(answered_with(here), 1u);
}

}  // namespace
}  // namespace limber::server
