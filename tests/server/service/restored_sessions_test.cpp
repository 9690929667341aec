// Sessions that come from a file, and what others do to them meanwhile.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <atomic>
#include <string>
#include <thread>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

ServerOptions storing_options(const std::filesystem::path& folder) {
  ServerOptions options = test_options();
  options.store.emplace();
  options.store->folder = folder;
  options.store->durability = store::Durability::kProcess;
  return options;
}

proto::Request restore_request(const std::string& content, const std::string& session) {
  proto::Request request;
  request.mutable_restore_session()->set_content(content);
  request.mutable_restore_session()->set_session(session);
  return request;
}

proto::Request close_request(const std::string& session) {
  proto::Request request;
  request.mutable_close_session()->set_session(session);
  return request;
}

/// An export of small_scene() with a base motion of several megabytes: it takes a while to store.
std::string large_export(Client& client) {
  constexpr std::uint32_t kFrames = 2000;
  constexpr int kCells = 100;
  proto::Scene scene = small_scene(kCells, kFrames);
  const Bar bar = make_bar(kCells);
  auto& motion = *scene.mutable_base_motion()->mutable_positions();
  motion.set_type(proto::DATA_TYPE_FLOAT64);
  motion.add_shape(kFrames);
  motion.add_shape(static_cast<std::uint64_t>(bar.node_count));
  motion.add_shape(3);
  const std::string rest = bytes_of(bar.nodes);
  for (std::uint32_t i = 0; i < kFrames; ++i) motion.mutable_data()->append(rest);
  EXPECT_TRUE(client.call(open_request(scene, "large")).has_open_session());
  proto::Request save;
  save.mutable_save_session()->set_session("large");
  std::string content = client.call(save).save_session().content();
  EXPECT_TRUE(client.call(close_request("large")).has_close_session());
  return content;
}

TEST(ServerRestoredSessions, OneThatIsClosedAtOnceDoesNotComeBack) {
  const TemporaryFolder folder;
  constexpr int kRounds = 8;
  {
    RunningServer server(storing_options(folder.path()));
    Client client(server->request_endpoint());
    const std::string content = large_export(client);
    ASSERT_GT(content.size(), 10U << 20U);
    for (int round = 0; round < kRounds; ++round) {
      const std::string name = fmt::format("copy{}", round);
      std::thread other([&] {
        Client closing(server->request_endpoint());
        while (!closing.call(close_request(name)).has_close_session()) std::this_thread::yield();
      });
      const auto reply = client.call(restore_request(content, name));
      other.join();
      EXPECT_TRUE(reply.has_restore_session()) << reply.error().message();
    }
  }
  RunningServer again(storing_options(folder.path()));
  Client client(again->request_endpoint());
  proto::Request list;
  list.mutable_list_sessions();
  EXPECT_EQ(client.call(list).list_sessions().sessions_size(), 0);
}

}  // namespace
}  // namespace limber::server
