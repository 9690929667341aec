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

/// A session in which an earlier server took ids that are not taken any more, as it was exported.
proto::StoredSession with_large_ids(Client& client) {
  EXPECT_TRUE(client.call(open_request(small_scene(), "old")).has_open_session());
  EXPECT_TRUE(client.call(wait_request("old", 0)).has_wait());
  proto::Request save;
  save.mutable_save_session()->set_session("old");
  proto::StoredSession stored;
  EXPECT_TRUE(stored.ParseFromString(client.call(save).save_session().content()));
  stored.clear_answer();
  stored.clear_checksum();  // of a file of before
  for (const std::uint64_t id : {std::uint64_t{1} << 60U, ~std::uint64_t{0}}) {
    auto& edit = *stored.add_edits();
    edit.set_revision(static_cast<std::uint64_t>(stored.edits_size()));
    auto& constraint = *edit.add_edits()->mutable_add()->mutable_constraint();
    constraint.set_id(id);
    constraint.set_frame(5);
    constraint.add_nodes(27);
    constraint.mutable_displacement()->set_y(0.1);
  }
  return stored;
}

TEST(ServerRestoredSessions, IdsThatAnEarlierServerTookComeBack) {
  const TemporaryFolder folder;
  ServerOptions options = storing_options(folder.path());
  options.store->checkpoint_edits = 4;
  std::string exported;
  {
    RunningServer server(options);
    Client client(server->request_endpoint());
    const std::string content = with_large_ids(client).SerializeAsString();
    const auto restored = client.call(restore_request(content, "again"));
    ASSERT_TRUE(restored.has_restore_session()) << restored.error().message();
    EXPECT_EQ(restored.restore_session().revision(), 2U);
    for (std::uint64_t revision = 3; revision < 12; ++revision) {  // a checkpoint among them
      const double y = 0.01 * static_cast<double>(revision);
      ASSERT_TRUE(client.call(move_request("again", std::uint64_t{1} << 60U, 0, y, 0)).has_edit());
      ASSERT_TRUE(client.call(wait_request("again", revision)).has_wait());
    }
    proto::Request save;
    save.mutable_save_session()->set_session("again");
    exported = client.call(save).save_session().content();
    proto::StoredSession stored;
    ASSERT_TRUE(stored.ParseFromString(exported));
    EXPECT_TRUE(stored.has_checkpoint());
  }
  RunningServer server(options);
  Client client(server->request_endpoint());
  const auto waited = client.call(wait_request("again", 11));
  ASSERT_TRUE(waited.has_wait()) << waited.error().message();
  const auto copied = client.call(restore_request(exported, "copy"));
  EXPECT_TRUE(copied.has_restore_session()) << copied.error().message();
}

proto::Scene scene_of(Client& client, const std::string& session) {
  proto::Request request;
  request.mutable_get_session()->set_session(session);
  request.mutable_get_session()->set_with_scene(true);
  return client.call(request).get_session().scene();
}

TEST(ServerRestoredSessions, ThoseOfOlderServersKeepPublishedDifferences) {
  const TemporaryFolder folder;
  RunningServer server(storing_options(folder.path()));
  Client client(server->request_endpoint());
  EXPECT_TRUE(client.call(open_request(small_scene(), "new")).has_open_session());
  EXPECT_TRUE(client.call(wait_request("new", 0)).has_wait());
  proto::Request save;
  save.mutable_save_session()->set_session("new");
  proto::StoredSession stored;
  EXPECT_TRUE(stored.ParseFromString(client.call(save).save_session().content()));
  EXPECT_EQ(stored.scene().dynamics().discretisation(), proto::TIME_DISCRETISATION_SAMPLED);
  EXPECT_GT(stored.scene().dynamics().force_smoothing(), 0);
  // As older servers wrote it: an edit of the period alone behind it.
  stored.clear_answer();
  stored.clear_checksum();
  stored.mutable_scene()->mutable_dynamics()->Clear();
  stored.mutable_scene()->mutable_dynamics()->set_damping_ratio(0.1);
  auto& edit = *stored.add_edits();
  edit.set_revision(1);
  edit.add_edits()->mutable_set_dynamics()->set_period_frames(30);
  const auto restored = client.call(restore_request(stored.SerializeAsString(), "old"));
  ASSERT_TRUE(restored.has_restore_session()) << restored.error().message();
  const proto::Dynamics dynamics = scene_of(client, "old").dynamics();
  EXPECT_EQ(dynamics.discretisation(), proto::TIME_DISCRETISATION_DIFFERENCES);
  EXPECT_EQ(dynamics.period_frames(), 30);
  EXPECT_EQ(dynamics.damping_ratio(), 0);
  EXPECT_EQ(dynamics.force_smoothing(), 0);
}

TEST(ServerChosenIds, LargerThanDoublesCountAreRefusedByName) {
  RunningServer server;
  Client client(server->request_endpoint());
  constexpr std::uint64_t kLargest = (std::uint64_t{1} << 53U) - 1;
  open_and_solve(client, "s");
  const auto refused_field = [&](const proto::Request& request) {
    const auto reply = client.call(request);
    if (!reply.has_error()) return std::string();
    EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    return reply.error().field();
  };
  for (const std::uint64_t id : {kLargest + 1, std::uint64_t{1} << 60U, ~std::uint64_t{0}}) {
    proto::Request edit;
    edit.mutable_edit()->set_session("s");
    edit.mutable_edit()->add_edits()->mutable_remove()->set_id(1);
    auto& second = *edit.mutable_edit()->add_edits();
    second.mutable_add()->mutable_constraint()->set_id(id);
    EXPECT_EQ(refused_field(edit), "edits[1].add.constraint.id");
    second.mutable_add_keyframe()->mutable_keyframe()->set_id(id);
    EXPECT_EQ(refused_field(edit), "edits[1].add_keyframe.keyframe.id");
    second.mutable_add_target()->mutable_target()->set_id(id);
    EXPECT_EQ(refused_field(edit), "edits[1].add_target.target.id");
    proto::Scene scene = small_scene();
    auto& constraint = *scene.add_constraints();
    constraint.set_id(id);
    constraint.set_frame(5);
    constraint.add_nodes(27);
    constraint.mutable_displacement()->set_y(0.1);
    const std::string field = fmt::format("scene.constraints[{}].id", scene.constraints_size() - 1);
    EXPECT_EQ(refused_field(open_request(scene, "other")), field);
    proto::Request validate;
    *validate.mutable_validate_scene()->mutable_scene() = scene;
    const auto issues = client.call(validate).validate_scene();
    ASSERT_EQ(issues.issues_size(), 1);
    EXPECT_EQ(issues.issues(0).field(), field);
    EXPECT_EQ(issues.issues(0).code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  }
  proto::Request edit;
  edit.mutable_edit()->set_session("s");
  auto& constraint = *edit.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
  constraint.set_id(kLargest);
  constraint.set_frame(5);
  constraint.add_nodes(27);
  constraint.mutable_displacement()->set_y(0.1);
  EXPECT_EQ(client.call(edit).edit().constraint_ids(0), kLargest);
}

}  // namespace
}  // namespace limber::server
