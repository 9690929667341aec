#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <string>
#include <thread>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

/// Counts the models that are put into a folder: a built model is written aside, then renamed.
class BuiltModels {
 public:
  explicit BuiltModels(const std::filesystem::path& folder)
      : events_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
    EXPECT_GE(::inotify_add_watch(events_, folder.c_str(), IN_MOVED_TO), 0) << std::strerror(errno);
  }
  ~BuiltModels() { ::close(events_); }
  BuiltModels(const BuiltModels&) = delete;
  BuiltModels& operator=(const BuiltModels&) = delete;

  int count() {
    alignas(inotify_event) std::array<char, 4096> bytes{};
    for (ssize_t size = 0; (size = ::read(events_, bytes.data(), bytes.size())) > 0;) {
      for (ssize_t at = 0; at < size; ++count_) {
        inotify_event event{};
        std::memcpy(&event, bytes.data() + at, sizeof event);
        at += static_cast<ssize_t>(sizeof event + event.len);
      }
    }
    return count_;
  }

 private:
  const int events_;
  int count_ = 0;
};

struct ServerSharedBuilds : ::testing::Test {
  /// Of a body that takes about a second to build.
  static proto::Scene scene() {
    proto::Scene scene = small_scene(100);
    scene.mutable_model()->set_modes(16);
    scene.mutable_model()->set_basis_size(60);
    scene.mutable_model()->set_cubature_size(60);
    return scene;
  }
  static ServerOptions options(const std::filesystem::path& folder) {
    ServerOptions options = test_options();
    options.cache_folder = folder;
    return options;
  }
  static proto::SessionStatus status(Client& client, const std::string& session) {
    proto::Request request;
    request.mutable_get_session()->set_session(session);
    const auto reply = client.call(request);
    EXPECT_TRUE(reply.has_get_session()) << reply.ShortDebugString();
    return reply.get_session().status();
  }
  /// Until the session sees how far its build is, or has its model.
  static void await_build(Client& client, const std::string& session) {
    for (;; std::this_thread::sleep_for(milliseconds(1))) {
      const auto now = status(client, session);
      if (now.state() != proto::SESSION_STATE_BUILDING || now.progress().fraction() > 0) return;
    }
  }
  static void expect_solved(Client& client, const std::string& session) {
    const auto solved = client.call(wait_request(session, 0));
    ASSERT_TRUE(solved.has_wait()) << solved.ShortDebugString();
    EXPECT_TRUE(solved.wait().result().converged());
    EXPECT_EQ(status(client, session).state(), proto::SESSION_STATE_READY);
  }

  TemporaryFolder folder;
  BuiltModels built{folder.path()};
  RunningServer server{options(folder.path())};
  Client ana{server->request_endpoint()}, ben{server->request_endpoint()};
};

TEST_F(ServerSharedBuilds, SessionsOfTwoClientsShareTheRunningBuild) {
  ASSERT_TRUE(ana.call(open_request(scene(), "first")).has_open_session());
  await_build(ana, "first");
  ASSERT_TRUE(ben.call(open_request(scene(), "second")).has_open_session());
  expect_solved(ana, "first");
  expect_solved(ben, "second");
  EXPECT_EQ(built.count(), 1);
  open_and_solve(ben, "another");
  EXPECT_EQ(built.count(), 2);
}

TEST_F(ServerSharedBuilds, ASessionOutlivesTheOneWhoseBuildItWaitsFor) {
  ASSERT_TRUE(ana.call(open_request(scene(), "first")).has_open_session());
  await_build(ana, "first");
  ASSERT_TRUE(ben.call(open_request(scene(), "second")).has_open_session());
  await_build(ben, "second");
  proto::Request close;
  close.mutable_close_session()->set_session("first");
  ASSERT_TRUE(ana.call(close).has_close_session());
  expect_solved(ben, "second");
  EXPECT_EQ(built.count(), 1);
  ASSERT_TRUE(ana.call(open_request(scene(), "third")).has_open_session());
  expect_solved(ana, "third");
  EXPECT_TRUE(status(ana, "third").model().from_cache());
  EXPECT_EQ(built.count(), 1);
}

}  // namespace
}  // namespace limber::server
