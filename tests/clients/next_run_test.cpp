// What a server refuses at its end is sent to the run that follows it.
#include <gtest/gtest.h>

#include <set>

#include "clients/cpp/client.h"
#include "clients/cpp/opening.h"
#include "clients/cpp/waiting.h"
#include "tests/clients/fake_router.h"

namespace limber::client {
namespace {

/// A run that refuses `refusals` requests, and one in its place that answers, all but for jobs.
struct RunsThatFollow : ::testing::Test {
  static v1::Error at_the_end(bool is_handed_over = true) {
    v1::Error error;
    error.set_code(v1::ERROR_CODE_SHUTTING_DOWN);
    error.set_message("the server is going down");
    if (is_handed_over) (*error.mutable_details())["send_again"] = "true";
    return error;
  }
  std::vector<std::string> answer(const v1::Request& request) {
    ids.insert(request.id());
    v1::Reply reply;
    reply.set_version(1);
    reply.set_id(request.id());
    if (refused < refusals) {
      ++refused;
      *reply.mutable_error() = at_the_end(is_handed_over);
    } else if (request.has_get_job()) {
      reply.mutable_error()->set_code(v1::ERROR_CODE_NOT_FOUND);
      reply.mutable_error()->set_message("no such job");
    } else if (request.has_wait()) {
      waited_for = request.wait().session();
      reply.mutable_wait()->mutable_result()->set_revision(4);
    } else {
      reply.mutable_edit()->set_revision(5);
    }
    return {reply.SerializeAsString()};
  }
  static ClientOptions options() {
    ClientOptions options;
    options.timeout = Milliseconds{2000};
    return options;
  }
  static v1::OpenSessionResponse opened() {
    v1::OpenSessionResponse opened;
    opened.set_session("cup");
    opened.set_uid(7);
    opened.set_job(3);
    return opened;
  }

  int refusals = 2, refused = 0;
  bool is_handed_over = true;
  std::set<std::uint64_t> ids;
  std::string waited_for;
  FakeRouter router{[this](const v1::Request& request) { return answer(request); }};
  Client client{router.requests(), options()};
};

TEST_F(RunsThatFollow, GetRequestsUnderTheirIds) {
  EXPECT_EQ(client.call(v1::EditRequest{}).revision(), 5u);
  EXPECT_EQ(refused, 2);
  EXPECT_EQ(ids.size(), 1u);
}

TEST_F(RunsThatFollow, AreAskedUnlessNoneIsToCome) {
  is_handed_over = false;
  EXPECT_THROW(client.call(v1::EditRequest{}), ServerStopped);
  EXPECT_EQ(router.received(), 1);
}

TEST_F(RunsThatFollow, AreNotAwaitedBeyondTheTimeOfARequest) {
  refusals = 1000;
  EXPECT_THROW(client.call(v1::EditRequest{}), ServerStopped);
  EXPECT_GT(refused, 2);
  EXPECT_LT(refused, 12) << "each is asked after a pause, which grows";
}

TEST_F(RunsThatFollow, AreAskedForResultsToo) {
  v1::WaitRequest request;
  request.set_session("cup@7");
  EXPECT_EQ(wait_for_result(client, request, Milliseconds{20000}, {}).revision(), 4u);
  EXPECT_EQ(refused, 2);
}

TEST_F(RunsThatFollow, BuildSessionsWhoseJobsEndedWithTheRunBefore) {
  refusals = 1;
  wait_until_ready(client, opened(), {}, Milliseconds{20000});
  EXPECT_EQ(waited_for, "cup@7");
}

TEST_F(RunsThatFollow, AreToldOfWhereTheRunBeforeWasKilled) {
  refusals = 0;
  wait_until_ready(client, opened(), {}, Milliseconds{20000});
  EXPECT_EQ(waited_for, "cup@7");
}

TEST_F(RunsThatFollow, AreNotAwaitedForAJobOfARunThatIsTheLast) {
  is_handed_over = false;
  EXPECT_THROW(wait_until_ready(client, opened(), {}, Milliseconds{20000}), ServerStopped);
  EXPECT_EQ(waited_for, "");
}

}  // namespace
}  // namespace limber::client
