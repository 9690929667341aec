#include <gmock/gmock.h>

#include <cstring>
#include <thread>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerSessions : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};
};

/// The rest shape in every frame but one, where everything is lifted by 0.05.
proto::Array lifted_motion(const Bar& bar, std::size_t frames) {
  std::vector<double> positions;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    for (std::size_t i = 0; i < bar.nodes.size(); ++i)
      positions.push_back(bar.nodes[i] + (frame == 10 && i % 3 == 1 ? 0.05 : 0.0));
  }
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  array.add_shape(frames);
  array.add_shape(static_cast<std::uint64_t>(bar.node_count));
  array.add_shape(3);
  array.set_data(bytes_of(positions));
  return array;
}

TEST_F(ServerSessions, TheBaseMotionIsReturnedOrReportedAsLeftOut) {
  proto::Scene scene = small_scene();
  const proto::Array motion = lifted_motion(make_bar(6), 20);
  *scene.mutable_base_motion()->mutable_positions() = motion;
  for (const bool has_motion : {true, false}) {
    if (!has_motion) scene.clear_base_motion();
    const std::string id = client.call(open_request(scene)).open_session().session();
    proto::Request request;
    request.mutable_get_session()->set_session(id);
    EXPECT_FALSE(client.call(request).get_session().has_scene());
    request.mutable_get_session()->set_with_scene(true);
    const auto without = client.call(request).get_session();
    EXPECT_TRUE(without.has_scene());
    EXPECT_FALSE(without.scene().has_base_motion());
    EXPECT_EQ(without.base_motion_left_out(), has_motion);
    request.mutable_get_session()->set_with_base_motion(true);
    const auto with = client.call(request).get_session();
    EXPECT_FALSE(with.base_motion_left_out());
    EXPECT_EQ(with.scene().has_base_motion(), has_motion);
    if (!has_motion) continue;
    const auto& returned = with.scene().base_motion().positions();
    EXPECT_THAT(returned.shape(), ::testing::ElementsAre(20u, 28u, 3u));
    ASSERT_EQ(returned.data().size(), motion.data().size());
    for (std::size_t at = 0; at < motion.data().size(); at += sizeof(double)) {
      double has_subscriber = 0, got = 0;
      std::memcpy(&has_subscriber, motion.data().data() + at, sizeof has_subscriber);
      std::memcpy(&got, returned.data().data() + at, sizeof got);
      ASSERT_NEAR(got, has_subscriber, 1e-14);
    }
  }
}

TEST(ServerSessionsOfALimit, ABaseMotionBeyondTheMessageLimitIsRefused) {
  ServerOptions options = test_options();
  options.transport.message_bytes = 12000;
  RunningServer server(options);
  Client client(server->request_endpoint());
  proto::Scene scene = small_scene();
  proto::Array narrow = lifted_motion(make_bar(6), 20);  // 13440 bytes; fits as float32
  std::vector<float> values;
  for (std::size_t at = 0; at < narrow.data().size(); at += sizeof(double)) {
    double value = 0;
    std::memcpy(&value, narrow.data().data() + at, sizeof value);
    values.push_back(static_cast<float>(value));
  }
  narrow.set_type(proto::DATA_TYPE_FLOAT32);
  narrow.set_data(bytes_of(values));
  *scene.mutable_base_motion()->mutable_positions() = narrow;
  const std::string id = client.call(open_request(scene)).open_session().session();
  proto::Request request;
  request.mutable_get_session()->set_session(id);
  request.mutable_get_session()->set_with_base_motion(true);
  const auto error = client.call(request).error();
  EXPECT_EQ(error.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(error.field(), "with_base_motion");
  EXPECT_EQ(error.details().at("limit"), "12000");
}

TEST_F(ServerSessions, AnEditWithoutEffectIsAnsweredWithAWarning) {
  const std::string id = client.call(open_request(small_scene())).open_session().session();
  proto::Request request;
  request.mutable_edit()->set_session(id);
  auto* constraint = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
  constraint->set_frame(19);
  constraint->add_nodes(0);
  constraint->mutable_displacement()->set_y(0.1);
  const auto edited = client.call(request).edit();
  EXPECT_EQ(edited.revision(), 1u);
  ASSERT_EQ(edited.issues_size(), 2);
  EXPECT_EQ(edited.issues(0).field(), "edits[0].add.constraint.frame");
  EXPECT_EQ(edited.issues(1).field(), "edits[0].add.constraint.nodes");
  for (const auto& issue : edited.issues()) {
    EXPECT_EQ(issue.severity(), proto::Issue::SEVERITY_WARNING);
    EXPECT_EQ(issue.code(), proto::ERROR_CODE_UNSPECIFIED);
  }
  EXPECT_EQ(client.call(move_request(id, 1, 0, 0.2, 0)).edit().issues_size(), 0);
}

TEST_F(ServerSessions, OpenEditWaitFramesClose) {
  const auto opened = client.call(open_request(small_scene()));
  ASSERT_TRUE(opened.has_open_session()) << opened.ShortDebugString();
  const std::string id = opened.open_session().session();
  EXPECT_FALSE(id.empty());
  ASSERT_TRUE(client.call(wait_request(id, 0)).has_wait());

  const auto edited = client.call(move_request(id, 1, 0, 0.2, 0));
  EXPECT_EQ(edited.edit().revision(), 1u);
  EXPECT_THAT(edited.edit().constraint_ids(), ::testing::ElementsAre(1u));
  const auto first = client.call(wait_request(id, 1, 30, proto::WaitRequest::UNTIL_FIRST));
  EXPECT_GE(first.wait().result().revision(), 1u);
  const auto final = client.call(wait_request(id, 1));
  EXPECT_TRUE(final.wait().result().converged());
  EXPECT_LT(final.wait().result().max_constraint_error(), 0.2);

  proto::Request request;
  request.mutable_get_frames()->set_session(id);
  request.mutable_get_frames()->set_first_frame(5);
  request.mutable_get_frames()->set_frame_count(3);
  request.mutable_get_frames()->set_final_only(true);
  request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);
  const auto frames = client.call(request).get_frames().frames();
  EXPECT_EQ(frames.result().revision(), 1u);
  EXPECT_EQ(frames.frame_count(), 3u);
  EXPECT_THAT(frames.data().shape(), ::testing::ElementsAre(3u, 28u, 3u));

  request.mutable_get_geometry()->set_session(id);
  const auto geometry = client.call(request).get_geometry();
  // Eight columns of the model, and those that full shapes of the motion added.
  EXPECT_THAT(geometry.basis().shape(), ::testing::ElementsAre(28u, 3u, ::testing::Ge(8u)));
  EXPECT_THAT(geometry.tets().shape(), ::testing::ElementsAre(36u, 4u));
  EXPECT_EQ(geometry.basis_hash(), frames.basis_hash());
  request.mutable_get_geometry()->set_known_basis_hash(geometry.basis_hash());
  EXPECT_FALSE(client.call(request).get_geometry().has_basis());

  request.mutable_get_session()->set_session(id);
  request.mutable_get_session()->set_with_scene(true);
  const auto session = client.call(request).get_session();
  EXPECT_EQ(session.status().state(), proto::SESSION_STATE_READY);
  EXPECT_EQ(session.status().revision(), 1u);
  EXPECT_EQ(session.status().model().basis_size(), 8u);
  EXPECT_EQ(session.scene().constraints(0).displacement().y(), 0.2);

  request.mutable_close_session()->set_session(id);
  EXPECT_TRUE(client.call(request).has_close_session());
  EXPECT_EQ(client.call(wait_request(id, 0)).error().code(), proto::ERROR_CODE_NOT_FOUND);
  EXPECT_TRUE(
      client.call(open_request(small_scene(), id)).has_open_session());  // the name is free again
}

TEST_F(ServerSessions, RefusedEditsChangeNothing) {
  open_and_solve(client, "s");
  proto::Request request = move_request("s", 1, 0, 0.3, 0);
  request.mutable_edit()->add_edits()->mutable_remove()->set_id(99);
  const auto refused = client.call(request);
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_NOT_FOUND);
  EXPECT_EQ(refused.error().field(), "edits[1].remove.id");
  request = move_request("s", 1, 0, 0.3, 0);
  request.mutable_edit()->set_expected_revision(5);
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  request.mutable_get_session()->set_session("s");
  request.mutable_get_session()->set_with_scene(true);
  const auto session = client.call(request).get_session();
  EXPECT_EQ(session.status().revision(), 0u);
  EXPECT_EQ(session.scene().constraints(0).displacement().y(), 0.1);
}

TEST_F(ServerSessions, ConstraintsAreCountedThroughUndo) {
  open_and_solve(client, "s");
  const auto constraints = [&] {
    proto::Request request;
    request.mutable_get_session()->set_session("s");
    return client.call(request).get_session().status().constraints();
  };
  proto::Request request;
  request.mutable_edit()->set_session("s");
  auto* added = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
  added->set_frame(5);
  added->add_nodes(20);
  added->mutable_displacement()->set_z(0.05);
  EXPECT_TRUE(client.call(request).has_edit());
  EXPECT_EQ(constraints(), 2u);
  request.mutable_edit()->mutable_edits(0)->mutable_undo();
  EXPECT_TRUE(client.call(request).has_edit());
  EXPECT_EQ(constraints(), 1u);
}

/// Two clients drag the same constraint as fast as they can: every revision belongs to exactly one
/// of them, and both see the same last state.
TEST_F(ServerSessions, TwoClientsSeeOneOrder) {
  open_and_solve(client, "s");
  Client other(server->request_endpoint());
  constexpr int kEdits = 200;
  std::array<std::vector<std::uint64_t>, 2> revisions;
  const auto drag = [&](Client& who, std::size_t index) {
    for (int i = 0; i < kEdits; ++i) {
      const auto reply =
          who.call(move_request("s", 1, 0.01 * static_cast<double>(index), 0.001 * i, 0));
      revisions[index].push_back(reply.edit().revision());
    }
  };
  std::thread thread([&] { drag(other, 1); });
  drag(client, 0);
  thread.join();
  std::set<std::uint64_t> all;
  for (const auto& own : revisions) {
    EXPECT_TRUE(std::is_sorted(own.begin(), own.end()));
    all.insert(own.begin(), own.end());
  }
  EXPECT_EQ(all.size(), 2u * kEdits);
  EXPECT_EQ(*all.rbegin(), 2u * kEdits);
  // What is found out after a final result would otherwise be in one of the answers only.
  const auto checked = wait_request("s", 2 * kEdits, 60, proto::WaitRequest::UNTIL_CHECKED);
  const auto a = client.call(checked), b = other.call(checked);
  EXPECT_EQ(a.wait().result().SerializeAsString(), b.wait().result().SerializeAsString());
  // The last target is that of whoever made the last revision.
  proto::Request request;
  request.mutable_get_session()->set_session("s");
  request.mutable_get_session()->set_with_scene(true);
  const double x = client.call(request).get_session().scene().constraints(0).displacement().x();
  EXPECT_EQ(x, revisions[0].back() == 2u * kEdits ? 0.0 : 0.01);
}

TEST_F(ServerSessions, PipelinedEditsKeepTheirOrder) {
  open_and_solve(client, "s");
  std::vector<std::uint64_t> ids;
  for (int i = 0; i < 300; ++i) ids.push_back(client.send(move_request("s", 1, 0, 0.001 * i, 0)));
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto reply = client.receive();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->id(), ids[i]);
    EXPECT_EQ(reply->edit().revision(), i + 1);
  }
}

/// A session's name with its uid is the same session: its edits wait behind each other, those that
/// take long too.
TEST_F(ServerSessions, PipelinedEditsKeepTheirOrderUnderBothNames) {
  open_and_solve(client, "s");
  proto::Request status;
  status.mutable_get_session()->set_session("s");
  const std::string names[] = {
      "s", "s@" + std::to_string(client.call(status).get_session().status().uid())};
  std::vector<std::uint64_t> ids;
  for (int i = 0; i < 200; ++i) {
    proto::Request request = move_request(names[i % 2], 1, 0, 0.001 * i, 0);
    const proto::Edit edit = request.edit().edits(0);
    for (int k = 0; i % 20 == 0 && k < 5000; ++k) *request.mutable_edit()->add_edits() = edit;
    ids.push_back(client.send(request));
  }
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto reply = client.receive();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->id(), ids[i]);
    EXPECT_EQ(reply->edit().revision(), i + 1) << reply->ShortDebugString();
  }
}

TEST_F(ServerSessions, WaitsEndByTimeout) {
  open_and_solve(client, "s");
  const auto begin = std::chrono::steady_clock::now();
  const auto reply = client.call(wait_request("s", 1, 0.2));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_TIMEOUT);
  EXPECT_GE(took.count(), 0.19);
  EXPECT_EQ(client.call(wait_request("s", 1, 0)).error().field(), "timeout_s");
  EXPECT_EQ(client.call(wait_request("s", 1, -1)).error().field(), "timeout_s");
  EXPECT_EQ(client.call(wait_request("s", 1, 1e9)).error().field(), "timeout_s");
}

TEST_F(ServerSessions, AWaitIsAnsweredByAnothersEdit) {
  open_and_solve(client, "s");
  const auto id = client.send(wait_request("s", 1));
  Client other(server->request_endpoint());
  EXPECT_TRUE(other.call(move_request("s", 1, 0, 0.2, 0)).has_edit());
  const auto reply = client.receive();
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->id(), id);
  EXPECT_EQ(reply->wait().result().revision(), 1u);
}

TEST_F(ServerSessions, ClosingAnswersWhoWaits) {
  open_and_solve(client, "s");
  client.send(wait_request("s", 1));
  proto::Request request;
  request.mutable_list_sessions();
  ASSERT_TRUE(client.call(request).has_list_sessions());  // behind the wait: it has arrived
  Client other(server->request_endpoint());
  request.mutable_close_session()->set_session("s");
  EXPECT_TRUE(other.call(request).has_close_session());
  const auto reply = client.receive(milliseconds(5000));
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
}

TEST_F(ServerSessions, SessionsOutliveTheClientThatMadeThem) {
  {
    Client gone(server->request_endpoint());
    open_and_solve(gone, "s");
    gone.send(move_request("s", 1, 0, 0.2, 0));
    gone.socket().set(zmq::sockopt::linger, 2000);
  }
  const auto reply = client.call(wait_request("s", 1));
  EXPECT_EQ(reply.wait().result().revision(), 1u);
  proto::Request request;
  request.mutable_list_sessions();
  EXPECT_EQ(client.call(request).list_sessions().sessions_size(), 1);
}

TEST_F(ServerSessions, EditsBeforeTheModelIsBuiltCount) {
  ASSERT_TRUE(client.call(open_request(small_scene(40, 50), "s")).has_open_session());
  EXPECT_EQ(client.call(move_request("s", 1, 0, 0.3, 0)).edit().revision(), 1u);
  EXPECT_EQ(client.call(wait_request("s", 1)).wait().result().revision(), 1u);
}

}  // namespace
}  // namespace limber::server
