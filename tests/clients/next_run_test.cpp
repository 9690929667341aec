// What a server refuses at its end is sent to the run that follows it.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>

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
    if (is_silent && refused == refusals) return {};
    v1::Reply reply;
    reply.set_version(1);
    reply.set_id(request.id());
    if (refused < refusals) {
      ++refused;
      *reply.mutable_error() = at_the_end(is_handed_over);
    } else if (request.has_solve_beams()) {
      reply.mutable_solve_beams()->set_job(9);
    } else if (request.has_get_job()) {
      reply.mutable_error()->set_code(v1::ERROR_CODE_NOT_FOUND);
      reply.mutable_error()->set_field("job");
    } else if (request.has_wait()) {
      waited_for = request.wait().session();
      EXPECT_EQ(request.wait().until(), v1::WaitRequest::UNTIL_FINAL);
      if (build_fault != v1::ERROR_CODE_UNSPECIFIED) {
        reply.mutable_error()->set_code(build_fault);
      } else {
        reply.mutable_wait()->mutable_result()->set_revision(4);
      }
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

  const std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  std::atomic<int> refusals = 2, refused = 0;
  bool is_handed_over = true, is_silent = false;
  v1::ErrorCode build_fault = v1::ERROR_CODE_UNSPECIFIED;
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
  EXPECT_THROW(client.call(v1::EditRequest{}, Milliseconds{60000}), ServerStopped);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds{4})
      << "the time of what is large is not for this";
  EXPECT_GT(refused, 2);
  EXPECT_LT(refused, 12) << "each is asked after a pause, which grows";
}

TEST_F(RunsThatFollow, AreSentOneCopyAtATime) {
  refusals = 1;
  is_silent = true;
  EXPECT_THROW(client.call(v1::EditRequest{}), ServerStopped);
  EXPECT_LE(router.received(), 3) << "refused, sent again, and not while that has no answer";
}

TEST_F(RunsThatFollow, AreNotAskedForJobsNorToEnd) {
  v1::CancelRequest cancel;
  cancel.set_job(7);
  EXPECT_THROW(client.call(cancel), ServerStopped);
  EXPECT_THROW(client.call(v1::ShutdownRequest{}), ServerStopped);
  EXPECT_EQ(router.received(), 2);
}

TEST_F(RunsThatFollow, AreAskedToSolveFilesOfAJob) {
  v1::SolveBeamsRequest solve;
  solve.mutable_job();
  EXPECT_EQ(client.call(solve).job(), 9u);
  EXPECT_EQ(refused, 2);
}

TEST_F(RunsThatFollow, AreNotAskedForWhatWasSubmitted) {
  const std::uint64_t id = client.submit(v1::EditRequest{});
  EXPECT_THROW(client.collect<v1::EditRequest>(id), ServerStopped);
  EXPECT_EQ(router.received(), 1);
}

TEST_F(RunsThatFollow, AreAskedForResultsToo) {
  v1::WaitRequest request;
  request.set_session("cup@7");
  request.set_until(v1::WaitRequest::UNTIL_FINAL);
  EXPECT_EQ(wait_for_result(client, request, Milliseconds{20000}, {}).revision(), 4u);
  EXPECT_EQ(refused, 2);
}

TEST_F(RunsThatFollow, BuildSessionsWhoseJobsEndedWithTheRunBefore) {
  refusals = 1;
  wait_until_ready(client, opened(), {}, Milliseconds{20000});
  EXPECT_EQ(waited_for, "cup@7");
}

TEST_F(RunsThatFollow, SayWhyTheyCannotBuild) {
  build_fault = v1::ERROR_CODE_FAILED_PRECONDITION;
  try {
    wait_until_ready(client, opened(), {}, Milliseconds{20000});
    FAIL();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), build_fault);
  }
}

TEST_F(RunsThatFollow, BuildSessionsWhereTheRunBeforeWasKilled) {
  refusals = 0;
  wait_until_ready(client, opened(), {}, Milliseconds{20000});
  EXPECT_EQ(waited_for, "cup@7");
}

TEST_F(RunsThatFollow, AreNotAwaitedForAJobOfARunThatIsTheLast) {
  is_handed_over = false;
  EXPECT_THROW(wait_until_ready(client, opened(), {}, Milliseconds{20000}), ServerStopped);
  EXPECT_EQ(waited_for, "");
}

/// A ROUTER that answers one request, and then is gone.
void answer_once(const std::string& endpoint, v1::Error error) {
  zmq::context_t context;
  zmq::socket_t router(context, ZMQ_ROUTER);
  router.bind(endpoint);
  zmq::message_t peer, bytes;
  (void)router.recv(peer);
  do (void)router.recv(bytes);
  while (bytes.more());
  v1::Request request;
  ASSERT_TRUE(request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  v1::Reply reply;
  reply.set_version(1);
  reply.set_id(request.id());
  *reply.mutable_error() = std::move(error);
  router.send(peer, zmq::send_flags::sndmore);
  router.send(zmq::buffer(reply.SerializeAsString()), zmq::send_flags::none);
}

TEST(NextRun, GetsNothingOfWhatWasReportedAsRefused) {
  const TemporaryFolder folder;
  const std::string endpoint = "ipc://" + (folder.path() / "requests").string();
  Client client(endpoint, RunsThatFollow::options());
  std::thread first([&] { answer_once(endpoint, RunsThatFollow::at_the_end()); });
  EXPECT_THROW(client.call(v1::EditRequest{}), ServerStopped);
  first.join();
  zmq::context_t context;
  zmq::socket_t next(context, ZMQ_ROUTER);
  next.bind(endpoint);
  zmq::pollitem_t item{next.handle(), 0, ZMQ_POLLIN, 0};
  EXPECT_EQ(zmq::poll(&item, 1, std::chrono::milliseconds{1500}), 0);
}

}  // namespace
}  // namespace limber::client
