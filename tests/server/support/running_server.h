#pragma once

#include <google/protobuf/stubs/logging.h>

#include <filesystem>
#include <optional>
#include <thread>

#include "server/log/log.h"
#include "server/service/server.h"
#include "tests/server/support/client.h"
#include "tests/server/support/scenes.h"
#include "tests/support/temporary_folder.h"

namespace limber::server::testing {

inline ServerOptions test_options() {
  log::set_level(log::Level::kOff);
  google::protobuf::SetLogHandler(nullptr);
  ServerOptions options;
  options.transport.bind = "tcp://127.0.0.1:*";
  options.transport.stream = "tcp://127.0.0.1:0";
  // What is late on a loaded machine would still use a server that the test has destroyed.
  options.grace = std::chrono::seconds(60);
  return options;
}

/// A server in this process, on real sockets.
class RunningServer {
 public:
  explicit RunningServer(ServerOptions options = test_options(),
                         const std::optional<web::Options>& pages = std::nullopt)
      : server_(std::move(options), standard_kinds, pages),
        thread_([this] { ending_ = server_.run(); }) {}
  ~RunningServer() { stop(); }
  Server::Ending stop() {
    if (thread_.joinable()) {
      server_.request_stop();
      thread_.join();
    }
    return ending_;
  }
  Server* operator->() { return &server_; }

 private:
  Server server_;
  Server::Ending ending_ = Server::Ending::kLate;
  std::thread thread_;
};

/// Opens small_scene() (or another) and waits until it is solved.
inline void open_and_solve(Client& client, const std::string& session,
                           const proto::Scene& scene = small_scene()) {
  const auto opened = client.call(open_request(scene, session));
  ASSERT_TRUE(opened.has_open_session()) << opened.ShortDebugString();
  EXPECT_EQ(opened.open_session().session(), session);
  const auto solved = client.call(wait_request(session, 0));
  ASSERT_TRUE(solved.has_wait()) << solved.ShortDebugString();
  ASSERT_TRUE(solved.wait().result().converged());
}

}  // namespace limber::server::testing
