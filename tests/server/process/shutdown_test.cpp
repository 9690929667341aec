#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "tests/server/process/child_process.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using namespace limber::server::testing;
using Clock = std::chrono::steady_clock;

struct ServerShutdown : ::testing::Test {
  TemporaryFolder folder;
};

TEST_F(ServerShutdown, SignalsAnswerWhoWaitsAndExitWithZero) {
  for (const int signal : {SIGTERM, SIGINT}) {
    Daemon daemon(folder.path());
    Client client(daemon.requests);
    open_and_solve(client, "s");
    client.send(wait_request("s", 1, 60));
    ASSERT_TRUE(client.send(info_request()));
    ASSERT_TRUE(client.receive().has_value());  // so the wait has arrived
    const auto begin = Clock::now();
    daemon.process().signal(signal);
    const auto reply = client.receive(milliseconds(5000));
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->error().code(), proto::ERROR_CODE_SHUTTING_DOWN);
    EXPECT_EQ(daemon.process().wait(milliseconds(5000)), 0);
    EXPECT_LT(Clock::now() - begin, std::chrono::seconds(4));
    EXPECT_FALSE(std::filesystem::exists(daemon.ready_file()));
  }
}

TEST_F(ServerShutdown, ARunningBuildIsCancelled) {
  Daemon daemon(folder.path());
  Client client(daemon.requests);
  proto::Scene scene = small_scene(2000, 300);
  scene.mutable_model()->set_modes(30);
  scene.mutable_model()->set_basis_size(0);
  scene.mutable_model()->set_cubature_size(0);
  const auto opened = client.call(open_request(scene, "s"));
  ASSERT_TRUE(opened.has_open_session()) << opened.ShortDebugString();
  proto::Request request;
  request.mutable_get_job()->set_job(opened.open_session().job());
  request.mutable_get_job()->set_wait_s(60);
  client.send(request);
  client.send(wait_request("s", 0));
  std::this_thread::sleep_for(milliseconds(100));
  daemon.process().signal(SIGTERM);
  for (int i = 0; i < 2; ++i) {
    const auto reply = client.receive(milliseconds(5000));
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->error().code(), proto::ERROR_CODE_SHUTTING_DOWN);
  }
  EXPECT_EQ(daemon.process().wait(milliseconds(5000)), 0);
}

TEST_F(ServerShutdown, SessionsThatAreJustBeingOpened) {
  Daemon daemon(folder.path());
  Client client(daemon.requests);
  proto::Scene scene = small_scene(1500, 300);
  scene.mutable_model()->set_modes(30);
  for (int i = 0; i < 6; ++i) client.send(open_request(scene, std::to_string(i)));
  client.send(info_request());  // handled at once: the others have arrived, but are not open
  ASSERT_TRUE(client.receive().has_value());
  daemon.process().signal(SIGTERM);
  EXPECT_EQ(daemon.process().wait(milliseconds(6000)), 0);
  EXPECT_THAT(daemon.process().err(), HasSubstr("stopped after"));
  EXPECT_THAT(daemon.process().err(), ::testing::Not(HasSubstr("work still running")));
}

TEST_F(ServerShutdown, ByRequest) {
  Daemon daemon(folder.path(), {"--allow-shutdown"});
  Client client(daemon.requests);
  proto::Request request;
  request.mutable_shutdown();
  EXPECT_TRUE(client.call(request).has_shutdown());
  EXPECT_EQ(daemon.process().wait(milliseconds(5000)), 0);
  EXPECT_THAT(daemon.process().err(), HasSubstr("stopped after"));
}

TEST_F(ServerShutdown, ByRequestOnlyWhereItIsAllowed) {
  Daemon daemon(folder.path());
  Client client(daemon.requests);
  proto::Request request;
  request.mutable_shutdown();
  const auto refused = client.call(request);
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_UNSUPPORTED);
  EXPECT_THAT(refused.error().message(), HasSubstr("--allow-shutdown"));
  EXPECT_TRUE(client.call(info_request()).has_get_server_info());
}

TEST_F(ServerShutdown, AHangupDoesNotEndTheServer) {
  Daemon daemon(folder.path());
  Client client(daemon.requests);
  open_and_solve(client, "s");
  for (int i = 0; i < 3; ++i) daemon.process().signal(SIGHUP);
  EXPECT_TRUE(client.call(move_request("s", 1, 0, 0.2, 0)).has_edit());
  EXPECT_FALSE(daemon.process().wait(milliseconds(200)).has_value());
  EXPECT_THAT(daemon.process().err(), HasSubstr("SIGHUP"));
  daemon.process().signal(SIGTERM);
  EXPECT_EQ(daemon.process().wait(), 0);
}

TEST_F(ServerShutdown, WithFrozenSubscribersAndDeafClients) {
  Daemon daemon(folder.path());
  Client client(daemon.requests), deaf(daemon.requests, 1);
  Subscriber frozen(daemon.stream, 1);
  frozen.subscribe("");
  open_and_solve(client, "s", small_scene(150, 400));
  proto::Request request;
  request.mutable_get_frames()->set_session("s");
  request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);
  for (int i = 0; i < 50; ++i) deaf.send(request);
  for (int i = 1; i <= 30; ++i) client.call(move_request("s", 1, 0, 0.01 * i, 0));
  daemon.process().signal(SIGTERM);
  EXPECT_EQ(daemon.process().wait(milliseconds(6000)), 0) << daemon.process().err();
}

TEST_F(ServerShutdown, WithABacklogOfHeavyRequestsThatGrows) {
  Daemon daemon(folder.path());
  Client client(daemon.requests);
  open_and_solve(client, "s", small_scene(1500, 300));
  std::atomic<bool> flooding{true};
  std::vector<std::thread> floods;
  for (int i = 0; i < 3; ++i) {
    floods.emplace_back([&] {
      Client deaf(daemon.requests, 1);
      proto::Request request;
      request.mutable_get_frames()->set_session("s");
      request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);
      deaf.socket().set(zmq::sockopt::sndtimeo, 100);
      while (flooding) {
        try {
          deaf.send(request);
        } catch (const zmq::error_t&) {  // full: it is tried again
        }
      }
    });
  }
  std::this_thread::sleep_for(milliseconds(500));
  const auto begin = Clock::now();
  daemon.process().signal(SIGTERM);
  EXPECT_EQ(daemon.process().wait(milliseconds(6000)), 0) << daemon.process().err();
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(4));  // 2, and a busy machine
  EXPECT_THAT(daemon.process().err(), ::testing::Not(HasSubstr("work still running")));
  flooding = false;
  for (auto& flood : floods) flood.join();
}

TEST_F(ServerShutdown, RequestsDuringTheShutdownAreAnswered) {
  Daemon daemon(folder.path());
  Client client(daemon.requests);
  open_and_solve(client, "s");
  constexpr int kHalf = 100;
  for (int i = 0; i < kHalf; ++i) (void)client.send(info_request());
  // The signal comes amidst them, not before the first of them is there.
  int answered = 0;
  for (; answered < kHalf / 2; ++answered) ASSERT_TRUE(client.receive(milliseconds(5000)));
  daemon.process().signal(SIGTERM);
  for (int i = 0; i < kHalf; ++i) (void)client.send(info_request());
  // Every one that arrived before the socket closed has an answer: a result or SHUTTING_DOWN.
  while (const auto reply = client.receive(milliseconds(1500))) {
    EXPECT_TRUE(reply->has_get_server_info() ||
                reply->error().code() == proto::ERROR_CODE_SHUTTING_DOWN);
    ++answered;
  }
  EXPECT_GT(answered, kHalf / 2);
  EXPECT_EQ(daemon.process().wait(milliseconds(5000)), 0);
}

TEST_F(ServerShutdown, AKilledClientMidEditLeavesTheSessionToOthers) {
  Daemon daemon(folder.path());
  Client survivor(daemon.requests);
  open_and_solve(survivor, "s");
  const pid_t child = ::fork();
  if (child == 0) {  // another process that edits until it is killed
    Client client(daemon.requests);
    for (int i = 0;; ++i) client.call(move_request("s", 1, 0, 0.001 * (i % 100), 0));
  }
  proto::Request request;
  request.mutable_get_session()->set_session("s");
  for (int i = 0; i < 500 && survivor.call(request).get_session().status().revision() < 50; ++i) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  const auto revision = survivor.call(move_request("s", 1, 0, 0.2, 0)).edit().revision();
  EXPECT_GT(revision, 50u);
  EXPECT_TRUE(survivor.call(wait_request("s", revision)).wait().result().converged());
  daemon.process().signal(SIGTERM);
  EXPECT_EQ(daemon.process().wait(), 0);
}

}  // namespace
}  // namespace limber::server
