#include <gtest/gtest.h>

#include "server/kinds/bodies/memory_estimate.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

ServerOptions options_with(const std::function<void(ServerOptions&)>& change) {
  ServerOptions options = test_options();
  change(options);
  return options;
}

void expect_limit(const proto::Reply& reply, const std::string& limit, const std::string& value) {
  ASSERT_TRUE(reply.has_error());
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED) << reply.error().message();
  EXPECT_EQ(reply.error().details().at("limit"), limit);
  EXPECT_EQ(reply.error().details().at("value"), value);
}

TEST(ServerLimits, BytesOfAMessage) {
  RunningServer server(options_with([](auto& options) { options.transport.message_bytes = 4096; }));
  Client client(server->request_endpoint());
  proto::Request request = wait_request(std::string(5000, 'x'), 1);
  request.set_version(1);
  const auto size = request.ByteSizeLong();
  client.send_bytes(request.SerializeAsString());
  expect_limit(*client.receive(), "4096", std::to_string(size));
  EXPECT_EQ(client.call(info_request()).get_server_info().limits().message_bytes(), 4096u);
}

TEST(ServerLimits, FarBeyondThePeerIsCutOffAndComesBack) {
  RunningServer server(
      options_with([](auto& options) { options.transport.message_bytes = 1 << 20; }));
  Client client(server->request_endpoint());
  client.send_bytes(std::string(8 << 20, 'x'));
  EXPECT_FALSE(client.receive(milliseconds(300)).has_value());
  EXPECT_TRUE(
      client.call(info_request()).has_get_server_info());  // libzmq has reconnected by itself
}

TEST(ServerLimits, WhatIsHandledAtOnceIsSmall) {
  RunningServer server;
  Client client(server->request_endpoint());
  open_and_solve(client, "s");
  proto::Request request;
  request.mutable_edit()->set_session("s");
  for (int i = 0; i < 65537; ++i) request.mutable_edit()->add_edits()->mutable_undo();
  expect_limit(client.call(request), "65536", "65537");
  request = move_request("s", 1, 0, 0, 0);
  auto* constraint = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
  constraint->mutable_nodes()->Resize(5 << 20, 1);
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
}

TEST(ServerLimits, Sessions) {
  RunningServer server(options_with([](auto& options) { options.limits.sessions = 2; }));
  Client client(server->request_endpoint());
  ASSERT_TRUE(client.call(open_request(small_scene(), "a")).has_open_session());
  ASSERT_TRUE(client.call(open_request(small_scene(), "b")).has_open_session());
  expect_limit(client.call(open_request(small_scene(), "c")), "2", "3");
  EXPECT_EQ(client.call(open_request(small_scene(), "a")).error().code(),
            proto::ERROR_CODE_ALREADY_EXISTS);
  proto::Request request;
  request.mutable_close_session()->set_session("a");
  ASSERT_TRUE(client.call(request).has_close_session());
  EXPECT_TRUE(client.call(open_request(small_scene(), "c")).has_open_session());
}

TEST(ServerLimits, TetsFramesConstraints) {
  RunningServer server(options_with([](auto& options) {
    options.limits.mesh_tets = 36;
    options.limits.frames = 20;
    options.limits.constraints = 2;
  }));
  Client client(server->request_endpoint());
  expect_limit(client.call(open_request(small_scene(7))), "36", "42");
  expect_limit(client.call(open_request(small_scene(6, 21))), "20", "21");
  proto::Scene scene = small_scene();
  for (std::uint64_t id = 2; id < 4; ++id) {
    *scene.add_constraints() = scene.constraints(0);
    scene.mutable_constraints(static_cast<int>(id) - 1)->set_id(id);
  }
  expect_limit(client.call(open_request(scene)), "2", "3");
  open_and_solve(client, "s");
  proto::Request request;
  request.mutable_edit()->set_session("s");
  for (int i = 0; i < 2; ++i) {
    auto* added = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
    added->set_frame(3 + static_cast<std::uint32_t>(i));
    added->add_nodes(20);
    added->mutable_displacement();
  }
  const auto reply = client.call(request);
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(reply.error().details().at("limit"), "2");
}

TEST(ServerLimits, MemoryOfASessionIsEstimatedBeforeItIsBuilt) {
  RunningServer server(options_with([](auto& options) { options.limits.session_bytes = 10'000; }));
  Client client(server->request_endpoint());
  const auto reply = client.call(open_request(small_scene()));
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(reply.error().details().at("limit"), "10000");
  EXPECT_GT(std::stoull(reply.error().details().at("value")), 10'000u);
}

/// All that a session may have, with modes mixed of a hundred, fits many times.
TEST(ServerLimits, KeyframesTakeMemoryInProportion) {
  EXPECT_EQ(estimate_keyframe_bytes(0, 106, 20, 30), 0u);
  const auto half = estimate_keyframe_bytes(256, 106, 20, 30);
  const auto all = estimate_keyframe_bytes(512, 106, 20, 30);
  EXPECT_GT(all, 3 * half / 2);
  EXPECT_LT(all, 5 * half / 2);
  EXPECT_LT(all, std::uint64_t{1} << 30);
}

TEST(ServerLimits, ConstraintsCountAsMemory) {
  ServerOptions options = test_options();
  proto::Scene scene = small_scene();
  options.limits.session_bytes = 1;
  RunningServer tiny(options);
  Client asking(tiny->request_endpoint());
  const auto needed = std::stoull(asking.call(open_request(scene)).error().details().at("value"));
  options.limits.session_bytes = needed + estimate_constraint_bytes(9, 4);
  RunningServer server(options);
  Client client(server->request_endpoint());
  open_and_solve(client, "s", scene);
  const auto add = [&](int many) {
    proto::Request request;
    request.mutable_edit()->set_session("s");
    for (int i = 0; i < many; ++i) {
      *request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint() =
          scene.constraints(0);
      request.mutable_edit()->mutable_edits(i)->mutable_add()->mutable_constraint()->set_id(0);
    }
    return client.call(request);
  };
  const auto refused = add(12);
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(refused.error().field(), "edits");
  EXPECT_EQ(refused.error().details().at("limit"), std::to_string(options.limits.session_bytes));
  EXPECT_TRUE(add(5).has_edit());
  // An undo in the same request does not hide how many there would be.
  proto::Request request;
  request.mutable_edit()->set_session("s");
  request.mutable_edit()->add_edits()->mutable_undo();
  for (int i = 0; i < 12; ++i) {
    auto* constraint = request.mutable_edit()->add_edits()->mutable_add()->mutable_constraint();
    *constraint = scene.constraints(0);
    constraint->set_id(0);
  }
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
}

TEST(ServerLimits, RunningJobs) {
  RunningServer server(options_with([](auto& options) {
    options.limits.jobs = 1;
    options.session_threads = 1;
  }));
  Client client(server->request_endpoint());
  proto::Request simulate;
  auto& scene = *simulate.mutable_simulate()->mutable_scene();
  scene = small_scene(6, 20'000);
  scene.mutable_simulation()->mutable_gravity()->set_y(-9.81);
  const auto first = client.call(simulate);
  ASSERT_TRUE(first.has_simulate()) << first.ShortDebugString();
  expect_limit(client.call(simulate), "1", "2");
  EXPECT_TRUE(client.call(open_request(small_scene(), "b")).has_open_session())
      << "jobs do not keep sessions from opening";
  proto::Request request;
  request.mutable_cancel()->set_job(first.simulate().job());
  EXPECT_TRUE(client.call(request).has_cancel());
  request.mutable_get_job()->set_job(first.simulate().job());
  request.mutable_get_job()->set_wait_s(30);
  EXPECT_EQ(client.call(request).get_job().status().state(), proto::JOB_STATE_CANCELLED);
  EXPECT_TRUE(client.call(simulate).has_simulate());
}

TEST(ServerLimits, RequestsThatWait) {
  RunningServer server(options_with([](auto& options) {
    options.limits.waits = 10;
    options.limits.sure_requests = 0;
  }));
  Client client(server->request_endpoint());
  open_and_solve(client, "s");
  for (int i = 0; i < 30; ++i) client.send(wait_request("s", 1, 0.5));
  int refused = 0, late = 0;
  for (int i = 0; i < 30; ++i) {
    const auto reply = client.receive();
    ASSERT_TRUE(reply.has_value());
    refused += reply->error().code() == proto::ERROR_CODE_LIMIT_EXCEEDED ? 1 : 0;
    late += reply->error().code() == proto::ERROR_CODE_TIMEOUT ? 1 : 0;
  }
  EXPECT_EQ(refused + late, 30);
  EXPECT_GE(refused, 19);
  EXPECT_GE(late, 9);
}

TEST(ServerLimits, AFewWaitsOfAClientAreNeverRefusedForThoseOfOthers) {
  RunningServer server(options_with([](auto& options) {
    options.limits.waits = 10;
    options.limits.sure_requests = 3;
  }));
  Client greedy(server->request_endpoint()), modest(server->request_endpoint());
  open_and_solve(greedy, "s");
  for (int i = 0; i < 11; ++i) greedy.send(wait_request("s", 1, 60));
  expect_limit(*greedy.receive(), "10", "11");
  for (int i = 0; i < 4; ++i) modest.send(wait_request("s", 1, 60));
  const auto refused = modest.receive();
  ASSERT_TRUE(refused.has_value());
  EXPECT_EQ(refused->id(), 4u);  // three wait, and are answered when there is something
  EXPECT_EQ(refused->error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_TRUE(greedy.send(move_request("s", 1, 0, 0.2, 0)));
  for (int i = 0; i < 3; ++i) {
    const auto answered = modest.receive();
    ASSERT_TRUE(answered.has_value());
    EXPECT_TRUE(answered->has_wait()) << answered->ShortDebugString();
  }
}

TEST(ServerLimits, WaitsOfAClientThatIsGoneAreReleasedAtOnce) {
  RunningServer server(options_with([](auto& options) { options.limits.jobs = 2; }));
  Client client(server->request_endpoint());
  open_and_solve(client, "s");
  const auto opened = client.call(open_request(small_scene(2000, 300), "slow"));
  ASSERT_TRUE(opened.has_open_session());
  const auto open = [&] {
    return client.call(info_request()).get_server_info().counters().at("open_requests");
  };
  Client staying(server->request_endpoint());
  staying.send(wait_request("s", 1000, 3600));
  while (open() < 2) std::this_thread::sleep_for(milliseconds(1));
  for (int round = 0; round < 5; ++round) {  // the next one has the same descriptor
    Client gone(server->request_endpoint());
    proto::Request job;
    job.mutable_get_job()->set_job(opened.open_session().job());
    job.mutable_get_job()->set_wait_s(3600);
    for (int i = 0; i < 400; ++i) gone.send(wait_request("s", 1000, 3600));
    gone.send(job);
    if (round % 2 == 0) {  // else it is gone before its requests are read, perhaps
      for (int i = 0; i < 5000 && open() < 100; ++i) std::this_thread::sleep_for(milliseconds(1));
    }
  }
  for (int i = 0; i < 5000 && open() > 2; ++i) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(open(), 2u);  // that of the client which stays, and this one
  EXPECT_TRUE(client.call(move_request("s", 1, 0, 0.2, 0)).has_edit());
}

TEST(ServerLimits, RequestsOfOneClient) {
  RunningServer server(options_with([](auto& options) { options.limits.client_requests = 10; }));
  Client greedy(server->request_endpoint()), other(server->request_endpoint());
  open_and_solve(other, "s");
  for (int i = 0; i < 30; ++i) greedy.send(wait_request("s", 1, 1.0));
  for (int i = 0; i < 20; ++i) {
    const auto reply = greedy.receive();
    ASSERT_TRUE(reply.has_value());
    expect_limit(*reply, "10", "11");
    EXPECT_EQ(reply->error().field(), "body");
  }
  // Neither heavy requests nor waits are taken beyond; what is answered at once is, and nobody else
  // is touched.
  proto::Request geometry;
  geometry.mutable_get_geometry()->set_session("s");
  expect_limit(greedy.call(geometry), "10", "11");
  EXPECT_TRUE(greedy.call(info_request()).has_get_server_info());
  EXPECT_TRUE(other.call(geometry).has_get_geometry());
  for (int i = 0; i < 10; ++i) {
    const auto reply = greedy.receive();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->error().code(), proto::ERROR_CODE_TIMEOUT);
  }
  EXPECT_TRUE(greedy.call(geometry).has_get_geometry());
}

TEST(ServerLimits, AStreamOfEditsHasNone) {
  RunningServer server(options_with([](auto& options) { options.limits.client_requests = 10; }));
  Client client(server->request_endpoint());
  open_and_solve(client, "s");
  constexpr int kEdits = 3000;
  for (int i = 0; i < kEdits; ++i) client.send(move_request("s", 1, 0, 1e-5 * i, 0));
  for (int i = 0; i < kEdits; ++i) {
    const auto reply = client.receive();
    ASSERT_TRUE(reply.has_value());
    ASSERT_TRUE(reply->has_edit()) << reply->ShortDebugString();
  }
}

TEST(ServerLimits, WhatAClientThatIsGoneHadWaitingIsDropped) {
  RunningServer server(options_with([](auto& options) { options.request_threads = 1; }));
  Client client(server->request_endpoint());
  open_and_solve(client, "s", small_scene(1500, 400));
  proto::Request request;
  request.mutable_get_frames()->set_session("s");
  request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);  // 29 MB: takes its time
  const auto open = [&] {
    return client.call(info_request()).get_server_info().counters().at("open_requests");
  };
  {
    Client gone(server->request_endpoint(), 1);
    for (int i = 0; i < 900; ++i) gone.send(request);
    for (int i = 0; i < 1000 && open() < 500; ++i) std::this_thread::sleep_for(milliseconds(1));
  }
  const std::uint64_t replies = server->counters().replies.load();
  std::uint64_t calls = 0;
  while (open() > 1 && ++calls < 3000) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(open(), 1u);
  EXPECT_GT(server->counters().dropped_replies.load(), 400u);
  EXPECT_LT(server->counters().replies.load() - replies, calls + 100);  // the rest was not made
  EXPECT_TRUE(client.call(request).has_get_frames());
}

TEST(ServerLimits, BytesOfOneClientThatWait) {
  ServerOptions options = test_options();
  options.limits.queued_request_bytes = 4 << 20;
  options.request_threads = 1;
  RunningServer server(options);
  Client client(server->request_endpoint());
  proto::Request request;
  request.mutable_validate_scene()->mutable_scene()->set_name(std::string(900'000, 'x'));
  for (int i = 0; i < 50; ++i) client.send(request);
  int refused = 0;
  for (int i = 0; i < 50; ++i) {
    const auto reply = client.receive();
    ASSERT_TRUE(reply.has_value());
    refused += reply->has_error() ? 1 : 0;
    if (reply->has_error()) {
      EXPECT_EQ(reply->error().details().at("limit"), std::to_string(2 << 20));
      EXPECT_EQ(reply->error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
    }
  }
  EXPECT_LT(refused, 49);
}

TEST(ServerLimits, UnreadRepliesOfAClientWhoDoesNotRead) {
  RunningServer server(
      options_with([](auto& options) { options.transport.unread_bytes = 4 << 20; }));
  Client client(server->request_endpoint());
  open_and_solve(client, "s", small_scene(150, 400));
  Client deaf(server->request_endpoint(), 1);
  proto::Request request;
  request.mutable_get_frames()->set_session("s");
  request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);  // 2.9 MB
  const std::uint64_t before = server->counters().requests.load();
  for (int i = 0; i < 100; ++i) deaf.send(request);
  // Wait until all are dealt with, then see what the client finds: answers, and refusals that say
  // why.
  const auto open = [&] {
    return client.call(info_request()).get_server_info().counters().at("open_requests");
  };
  for (std::uint64_t calls = 0; calls < 3000; ++calls) {
    if (open() == 1 && server->counters().requests.load() > before + 100 + calls) break;
    std::this_thread::sleep_for(milliseconds(10));
  }
  int answers = 0, refusals = 0;
  while (const auto reply = deaf.receive(milliseconds(1000))) {
    answers += reply->has_get_frames() ? 1 : 0;
    refusals += reply->error().code() == proto::ERROR_CODE_LIMIT_EXCEEDED ? 1 : 0;
  }
  EXPECT_EQ(answers + refusals, 100);
  EXPECT_GE(answers, 1);
  // How many answers the transport takes before it says no depends on who is faster.
  EXPECT_GE(refusals, 20);
}

TEST(ServerLimits, UnreadRepliesOfAllClientsTogether) {
  RunningServer server(options_with([](auto& options) {
    options.transport.message_bytes = 8 << 20;
    options.transport.unread_total_bytes = 24 << 20;
  }));
  Client client(server->request_endpoint());
  open_and_solve(client, "s", small_scene(150, 400));
  proto::Request request;
  request.mutable_get_frames()->set_session("s");
  request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);  // 2.9 MB
  std::vector<std::unique_ptr<Client>> deaf;
  for (int i = 0; i < 3; ++i)
    deaf.push_back(std::make_unique<Client>(server->request_endpoint(), 1));
  for (int i = 0; i < 30; ++i) {
    for (const auto& each : deaf) each->send(request);
  }
  const auto counter = [&](const char* name) {
    return client.call(info_request()).get_server_info().counters().at(name);
  };
  std::uint64_t most = 0;
  for (int i = 0;
       i < 3000 && (server->counters().requests.load() < 90 || counter("open_requests") > 1); ++i) {
    most = std::max(most, counter("unread_bytes"));
    std::this_thread::sleep_for(milliseconds(5));
  }
  most = std::max(most, counter("unread_bytes"));
  // Short errors, which are 250 bytes, are bounded apart.
  EXPECT_LE(most, (24u << 20) + 100 * 1024);
  EXPECT_GT(most, 6u << 20);
  EXPECT_GT(counter("refused_replies"), 0u);
  // Who reads gets its answer, however much others leave.
  EXPECT_TRUE(client.call(request).has_get_frames());
}

TEST(ServerLimits, NamesOfSessions) {
  RunningServer server;
  Client client(server->request_endpoint());
  const std::vector<std::string> names{".", "..", "a/b", std::string(100'000'000, 'x')};
  for (const auto& name : names) {
    const auto refused = client.call(open_request(small_scene(), name));
    EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_EQ(refused.error().field(), "session");
    EXPECT_LT(refused.ByteSizeLong(), 1000u);
    proto::Request request;
    request.mutable_get_session()->set_session(name);
    const auto unknown = client.call(request);
    EXPECT_EQ(unknown.error().code(), proto::ERROR_CODE_NOT_FOUND);
    EXPECT_LT(unknown.ByteSizeLong(), 1000u);
  }
  proto::Request request;
  request.mutable_get_sample()->set_name(std::string(100'000'000, 'y'));
  EXPECT_LT(client.call(request).ByteSizeLong(), 10'000u);
}

TEST(MemoryEstimate, GrowsWithEverySize) {
  scene::Scene scene;
  scene.mesh.nodes.resize(3, 1000);
  scene.mesh.tets.resize(4, 4000);
  scene.frame_count = 100;
  const auto base = estimate_session_bytes(scene);
  scene.mesh.nodes.resize(3, 10000);
  EXPECT_GT(estimate_session_bytes(scene), 9 * base);
  scene.mesh.nodes.resize(3, 1000);
  scene.frame_count = 100'000;
  EXPECT_GT(estimate_session_bytes(scene), base);
}

}  // namespace
}  // namespace limber::server
