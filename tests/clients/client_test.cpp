#include "clients/cpp/client.h"

#include <gmock/gmock.h>

#include <chrono>
#include <functional>

#include "clients/cpp/open_session.h"
#include "clients/cpp/session_reference.h"
#include "clients/cpp/skew.h"
#include "clients/cpp/waiting.h"
#include "tests/clients/fake_router.h"
#include "tests/clients/refusal.h"

namespace limber::client {
namespace {

using testing::HasSubstr;

std::string bytes(v1::Reply reply, const v1::Request& request) {
  reply.set_version(1);
  reply.set_id(request.id());
  return reply.SerializeAsString();
}

v1::Reply session_reply(const std::string& name) {
  v1::Reply reply;
  reply.mutable_get_session()->mutable_status()->set_session(name);
  return reply;
}

ClientOptions impatient(int ms = 250) {
  ClientOptions options;
  options.timeout = Milliseconds{ms};
  return options;
}

TEST(Client, AnswersInAnyOrderReachTheirRequests) {
  std::vector<v1::Request> held;
  FakeRouter router([&](const v1::Request& request) {
    held.push_back(request);
    std::vector<std::string> replies;
    if (held.size() == 3)
      for (auto it = held.rbegin(); it != held.rend(); ++it)
        replies.push_back(bytes(session_reply(it->get_session().session()), *it));
    return replies;
  });
  Client client(router.requests());
  std::vector<std::uint64_t> ids;
  for (const char* name : {"a", "b", "c"}) {
    v1::GetSessionRequest request;
    request.set_session(name);
    ids.push_back(client.submit(request));
  }
  EXPECT_EQ(client.collect<v1::GetSessionRequest>(ids[1]).status().session(), "b");
  EXPECT_EQ(client.collect<v1::GetSessionRequest>(ids[0]).status().session(), "a");
  EXPECT_EQ(client.collect<v1::GetSessionRequest>(ids[2]).status().session(), "c");
  EXPECT_EQ(refusal([&] { client.collect<v1::GetSessionRequest>(ids[2]); }).code(),
            v1::ERROR_CODE_NOT_FOUND);
}

TEST(Client, ARefusalCarriesCodeFieldMessageAndDetails) {
  FakeRouter router([](const v1::Request& request) {
    v1::Reply reply;
    reply.mutable_error()->set_code(v1::ERROR_CODE_OUT_OF_RANGE);
    reply.mutable_error()->set_field("edits[0].add.constraint.frame");
    reply.mutable_error()->set_message("frame 900 of 120");
    (*reply.mutable_error()->mutable_details())["limit"] = "120";
    return std::vector{bytes(reply, request)};
  });
  Client client(router.requests());
  const auto error = refusal([&] { client.call(v1::EditRequest{}); });
  EXPECT_EQ(error.code(), v1::ERROR_CODE_OUT_OF_RANGE);
  EXPECT_EQ(error.code_name(), "OUT_OF_RANGE");
  EXPECT_EQ(error.field(), "edits[0].add.constraint.frame");
  EXPECT_STREQ(error.what(), "frame 900 of 120");
  EXPECT_EQ(error.details().at("limit"), "120");
}

TEST(Client, RequestsToASilentServerAreRepeatedUnderOneIdAndShutdownIsNot) {
  std::vector<std::string> received;
  FakeRouter router([&](const v1::Request& request) {
    received.push_back(request.SerializeAsString());
    return std::vector<std::string>{};
  });
  Client client(router.requests(), impatient());
  EXPECT_THROW(client.call(v1::EditRequest{}), Unreachable);
  EXPECT_EQ(router.received(), 2);
  ASSERT_EQ(received.size(), 2u);
  EXPECT_EQ(received[0], received[1]);
  v1::Request request;
  ASSERT_TRUE(request.ParseFromString(received[0]));
  EXPECT_EQ(request.client().size(), 32u);
  EXPECT_THROW(client.call(v1::ShutdownRequest{}), Unreachable);
  EXPECT_EQ(router.received(), 3);
}

/// Answers as one run of limberd after another.
struct ClientOfARestartedServer : ::testing::Test {
  std::vector<std::string> answer(const v1::Request& request) {
    last = request;
    v1::Reply reply = session_reply("cup");
    reply.set_instance(instance);
    reply.mutable_get_session()->mutable_status()->set_uid(uid);
    const bool is_stale = !request.instance().empty() && request.instance() != instance;
    const std::string& session = request.get_session().session();
    if (is_stale || (session.starts_with("cup@") && session != "cup@" + std::to_string(uid))) {
      reply.mutable_error()->set_code(v1::ERROR_CODE_RESTARTED);
      reply.mutable_error()->set_message("the server was restarted");
    } else if (request.has_open_session()) {
      reply.mutable_open_session()->set_session("cup");
    } else if (request.has_get_server_info()) {
      reply.mutable_get_server_info();
    }
    return {bytes(reply, request)};
  }
  static v1::GetSessionRequest cup(const char* session = "cup") {
    v1::GetSessionRequest request;
    request.set_session(session);
    return request;
  }

  std::string instance = "first";
  std::uint64_t uid = 1;
  v1::Request last;
  FakeRouter router{[this](const v1::Request& request) { return answer(request); }};
  Client client{router.requests()};
};

TEST_F(ClientOfARestartedServer, ThrowsAnExceptionOfItsOwn) {
  (void)client.call(cup());
  EXPECT_EQ(client.instance(), "first");
  instance = "second";
  uid = 2;
  (void)client.call(v1::GetServerInfoRequest{});
  EXPECT_EQ(client.instance(), "first");  // not reported so far
  EXPECT_THROW((void)client.call(cup()), ServerRestarted);
  EXPECT_EQ(client.call(cup()).status().uid(), 2u);  // who asks again means the new one
  EXPECT_THROW((void)client.call(cup("cup@1")), ServerRestarted);
}

TEST_F(ClientOfARestartedServer, ContinuesWithASessionThatItOpensThere) {
  (void)client.call(cup());
  instance = "second";
  (void)client.call(v1::OpenSessionRequest{});
  EXPECT_EQ(client.instance(), "second");
  EXPECT_EQ(client.call(cup()).status().session(), "cup");
}

TEST_F(ClientOfARestartedServer, AReferenceKeepsItsSession) {
  (void)client.call(v1::GetServerInfoRequest{});
  SessionReference used(client, "cup"), unused(client, "cup");
  EXPECT_EQ(used.name(), "cup");
  EXPECT_EQ(used.get(client), "cup@1");
  instance = "second";
  uid = 2;
  EXPECT_THROW((void)client.call(cup()), ServerRestarted);
  EXPECT_EQ(used.get(client), "cup@1");
  EXPECT_THROW((void)unused.get(client), ServerRestarted);
  SessionReference fresh(client, "cup");
  EXPECT_EQ(fresh.get(client), "cup@2");
}

TEST(Client, ARepeatedRequestThatIsAnsweredSucceeds) {
  int count = 0;
  FakeRouter router([&](const v1::Request& request) {
    std::vector<std::string> replies;
    if (++count == 2) {
      v1::Reply reply;
      reply.mutable_list_jobs()->add_jobs()->set_job(7);
      replies.push_back(bytes(reply, request));
    }
    return replies;
  });
  Client client(router.requests(), impatient());
  EXPECT_EQ(client.call(v1::ListJobsRequest{}).jobs(0).job(), 7U);
}

TEST(Client, ATimeoutIsTheWholeTimeOfARequest) {
  FakeRouter router([](const v1::Request&) { return std::vector<std::string>{}; });
  Client client(router.requests(), impatient(1000));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THROW(client.call(v1::ListJobsRequest{}), Unreachable);
  EXPECT_LT(std::chrono::steady_clock::now() - start, Milliseconds{1700});
  EXPECT_EQ(router.received(), 2);
}

TEST(Client, ASlowAnswerCountsThoughTheRequestWasRepeated) {
  FakeRouter router([](const v1::Request& request) {
    std::this_thread::sleep_for(Milliseconds{700});
    v1::Reply reply;
    reply.mutable_list_jobs();
    return std::vector{bytes(reply, request)};
  });
  Client client(router.requests(), impatient(1000));
  EXPECT_NO_THROW(client.call(v1::ListJobsRequest{}));
}

TEST(Client, NobodyThereIsATimeoutNotAHang) {
  Client client("ipc:///nonexistent/limber-nobody", impatient(50));
  EXPECT_EQ(refusal([&] { client.call(v1::EditRequest{}); }).code(), v1::ERROR_CODE_TIMEOUT);
}

TEST(Client, GarbageAndAnswersToNobodyAreSkipped) {
  FakeRouter router([](const v1::Request& request) {
    v1::Request other = request;
    other.set_id(request.id() + 1000);
    return std::vector<std::string>{"\xff\xff\xff", "", bytes(session_reply("x"), other),
                                    bytes(session_reply("a"), request)};
  });
  Client client(router.requests());
  EXPECT_EQ(client.call(v1::GetSessionRequest{}).status().session(), "a");
}

TEST(Client, AnAnswerOfAnotherKindIsRefused) {
  FakeRouter router(
      [](const v1::Request& request) { return std::vector{bytes(session_reply("a"), request)}; });
  Client client(router.requests());
  EXPECT_EQ(refusal([&] { client.call(v1::ListJobsRequest{}); }).code(), v1::ERROR_CODE_MALFORMED);
}

TEST(Client, GreetingNamesAnotherProtocol) {
  FakeRouter router([](const v1::Request& request) {
    v1::Reply reply;
    reply.mutable_get_server_info()->set_server_version("9.9");
    reply.mutable_get_server_info()->add_protocol_versions(2);
    return std::vector{bytes(reply, request)};
  });
  Client client(router.requests());
  const auto error = refusal([&] { (void)greet(client); });
  EXPECT_EQ(error.code(), v1::ERROR_CODE_UNSUPPORTED);
  EXPECT_THAT(error.what(), HasSubstr("limberd 9.9 speaks protocol 2"));
  EXPECT_THAT(error.what(), HasSubstr("protocol 1: update the client"));
}

TEST(Client, GreetingNamesAnOlderServer) {
  EXPECT_EQ(other_protocol("0.0.1", {0}),
            std::string("limberd 0.0.1 speaks protocol 0, this client (") + client_version() +
                ") protocol 1: update the server");
}

TEST(Client, TheVersionIsToldWhereTheServerKnowsOfIt) {
  std::vector<std::string> told;  // read when the router has ended
  {
    FakeRouter router([&](const v1::Request& request) {
      v1::Reply reply;
      told.push_back(request.get_server_info().client_version());
      if (!told.back().empty()) {  // as a server of before
        reply.mutable_error()->set_code(v1::ERROR_CODE_INVALID_ARGUMENT);
        reply.mutable_error()->set_message("unknown field number 1 in GetServerInfoRequest");
      } else {
        reply.mutable_get_server_info()->add_protocol_versions(1);
      }
      return std::vector{bytes(reply, request)};
    });
    Client client(router.requests());
    EXPECT_NO_THROW((void)greet(client));
  }
  EXPECT_EQ(told, (std::vector<std::string>{client_version(), ""}));
}

TEST(Client, AnInterruptionEndsTheWaitWithoutTheDeadline) {
  FakeRouter router([](const v1::Request&) { return std::vector<std::string>{}; });
  ClientOptions options;
  options.timeout = Milliseconds{60000};
  int calls = 0;
  options.interrupted = [&] { return ++calls > 3; };
  Client client(router.requests(), options);
  EXPECT_EQ(refusal([&] { client.call(v1::EditRequest{}); }).code(), v1::ERROR_CODE_CANCELLED);
}

TEST(Client, AWaitForTheErrorOfAMotionSaysSo) {
  FakeRouter router([](const v1::Request& request) {
    v1::Reply reply;
    auto& result = *reply.mutable_wait()->mutable_result();
    result.set_revision(request.wait().revision());
    if (request.wait().until() == v1::WaitRequest::UNTIL_CHECKED)
      result.mutable_motion_error()->set_shape_error(0.02);
    return std::vector{bytes(reply, request)};
  });
  Client client(router.requests());
  OpenSession session(client, "s", Naming::kAsGiven);
  WaitOptions options;
  options.revision = 4;
  options.until = v1::WaitRequest::UNTIL_CHECKED;
  const auto checked = session.wait(options);
  EXPECT_EQ(checked.revision(), 4u);
  EXPECT_DOUBLE_EQ(checked.motion_error().shape_error(), 0.02);
  EXPECT_FALSE(session.wait(Milliseconds{1000}).has_motion_error());
}

/// A server that does not answer the first requests that wait for a result or a job.
struct SilentWaits : ::testing::Test {
  std::vector<std::string> answer(const v1::Request& request) {
    const bool is_wait = request.has_wait() || request.has_get_job();
    if (is_wait && ++waits <= silent) return {};
    if (request.has_get_server_info() && !is_there) return {};
    v1::Reply reply;
    if (request.has_wait()) reply.mutable_wait()->mutable_result()->set_revision(4);
    if (request.has_get_job())
      reply.mutable_get_job()->mutable_status()->set_state(v1::JOB_STATE_DONE);
    if (request.has_get_server_info()) reply.mutable_get_server_info()->add_protocol_versions(1);
    return {bytes(reply, request)};
  }
  void expect_soon_unreachable(const std::function<void()>& wait) {
    is_there = false;
    silent = 100;
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_THROW(wait(), Unreachable);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds{5});
  }

  int silent = 1;
  bool is_there = true;
  int waits = 0;
  FakeRouter router{[this](const v1::Request& request) { return answer(request); }};
  Client client{router.requests(), impatient(200)};
  OpenSession session{client, "s", Naming::kAsGiven};
};

TEST_F(SilentWaits, ContinueWhileTheServerAnswers) {
  EXPECT_EQ(session.wait().revision(), 4u);
  EXPECT_EQ(waits, 2);
}

TEST_F(SilentWaits, EndSoonWithoutAServer) {
  expect_soon_unreachable([&] { (void)session.wait(); });
}

TEST_F(SilentWaits, OfJobsContinueWhileTheServerAnswers) {
  EXPECT_EQ(wait_job(client, 7, {}, Milliseconds{60000}).status().state(), v1::JOB_STATE_DONE);
  EXPECT_EQ(waits, 2);
}

TEST_F(SilentWaits, OfJobsEndSoonWithoutAServer) {
  expect_soon_unreachable([&] { (void)wait_job(client, 7, {}, Milliseconds{60000}); });
}

/// A server with job 7: half done at the first look, then as `ended` says.
struct WaitsForAJob : ::testing::Test {
  std::vector<std::string> answer(const v1::Request& request) {
    v1::Reply reply;
    *reply.mutable_get_job() = ended;
    if (looks++ == 0 || is_running) {
      auto& status = *reply.mutable_get_job()->mutable_status();
      status.Clear();
      status.set_state(v1::JOB_STATE_RUNNING);
      status.mutable_progress()->set_fraction(0.5);
    }
    return {bytes(reply, request)};
  }
  v1::GetJobResponse wait(Milliseconds timeout = Milliseconds{60000}) {
    return wait_job(
        client, 7, [&](const v1::JobStatus& status) { states.push_back(status.state()); }, timeout);
  }

  v1::GetJobResponse ended;
  bool is_running = false;
  int looks = 0;
  std::vector<v1::JobState> states;
  FakeRouter router{[this](const v1::Request& request) { return answer(request); }};
  Client client{router.requests(), impatient(1000)};
};

TEST_F(WaitsForAJob, ReturnTheResult) {
  ended.mutable_status()->set_state(v1::JOB_STATE_DONE);
  ended.mutable_tetrahedralization()->set_tets(12);
  EXPECT_EQ(wait().tetrahedralization().tets(), 12u);
  EXPECT_EQ(states, (std::vector{v1::JOB_STATE_RUNNING, v1::JOB_STATE_DONE}));
}

TEST_F(WaitsForAJob, ThrowWhatItFailedWith) {
  ended.mutable_status()->set_state(v1::JOB_STATE_FAILED);
  ended.mutable_status()->mutable_error()->set_code(v1::ERROR_CODE_NUMERICAL);
  EXPECT_EQ(refusal([&] { wait(); }).code(), v1::ERROR_CODE_NUMERICAL);
  EXPECT_EQ(states, std::vector{v1::JOB_STATE_RUNNING});
}

TEST_F(WaitsForAJob, SayThatItWasCancelled) {
  ended.mutable_status()->set_state(v1::JOB_STATE_CANCELLED);
  const auto error = refusal([&] { wait(); });
  EXPECT_EQ(error.code(), v1::ERROR_CODE_CANCELLED);
  EXPECT_STREQ(error.what(), "job 7 ended without a result");
}

TEST_F(WaitsForAJob, EndWithTheirTime) {
  is_running = true;
  const auto error = refusal([&] { wait(Milliseconds{20}); });
  EXPECT_EQ(error.code(), v1::ERROR_CODE_TIMEOUT);
  EXPECT_STREQ(error.what(), "job 7 still runs after 0.02 s");
}

TEST(Client, ANameIsSentAsGivenOnRequest) {
  std::vector<std::string> seen;
  FakeRouter router([&](const v1::Request& request) {
    v1::Reply reply;
    if (request.has_cancel()) {
      seen.push_back(request.cancel().session());
      reply.mutable_cancel();
    } else {
      reply = session_reply("s");
      reply.mutable_get_session()->mutable_status()->set_uid(7);
    }
    return std::vector{bytes(reply, request)};
  });
  Client client(router.requests());
  OpenSession(client, "s", Naming::kAsGiven).cancel();
  EXPECT_EQ(router.received(), 1);
  OpenSession(client, "s").cancel();
  EXPECT_EQ(router.received(), 3);
  EXPECT_EQ(seen, (std::vector<std::string>{"s", "s@7"}));
}

TEST(Client, OptionsAreValidated) {
  EXPECT_EQ(refusal([] { Client client("no endpoint"); }).field(), "endpoint");
  EXPECT_EQ(refusal([] { Client client("ipc:///tmp/x", impatient(0)); }).field(), "timeout");
  ClientOptions options;
  options.keys = CurveKeys{std::string(40, 'a'), "short", std::string(40, 'a')};
  EXPECT_EQ(refusal([&] { Client client("ipc:///tmp/x", options); }).field(), "keys.public_key");
}

}  // namespace
}  // namespace limber::client
