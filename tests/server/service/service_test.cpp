#include "server/service/service.h"

#include <gtest/gtest.h>

#include <boost/asio/post.hpp>
#include <future>
#include <initializer_list>

#include "server/kinds/beams/record.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

/// A service on real sockets whose threads for heavy requests can be held up.
struct ServerService : ::testing::Test {
  explicit ServerService(ServerOptions options = test_options()) : hub(std::move(options)) {
    hub.transport.start(
        {[this](Address address, zmq::message_t payload) {
           service.handle(std::move(address), std::move(payload));
         },
         [this](const std::string& prefix, Has has) { service.subscribed(prefix, has); },
         [this](const Address& address, const UnreadReplies::Excess& excess) {
           return service.overflow_reply(address, excess);
         },
         [this](const std::string& of) { service.gone(of); },
         [this](const std::string& of) { service.disconnected(of); }});
  }
  ~ServerService() override {
    if (held) release();
    for (const auto& record : service.sessions().all()) record->close_session();
    hub.transport.stop();
    hub.session_pool.join();
    hub.request_pool.join();
    hub.patient_request_pool.join();
  }
  void hold() { hold({&hub.request_pool, &hub.patient_request_pool}); }
  void hold(std::initializer_list<boost::asio::thread_pool*> pools) {
    const std::shared_future<void> opened = gate.get_future().share();
    for (boost::asio::thread_pool* pool : pools) {
      for (int i = 0; i < hub.options.request_threads; ++i)
        boost::asio::post(*pool, [opened] { opened.wait(); });
    }
    held = true;
  }
  void release() {
    gate.set_value();
    held = false;
  }
  /// @returns whether so many requests are open within a time that no machine needs
  bool open_requests_become(std::uint64_t count) {
    for (int i = 0; i < 20'000 && hub.open_requests.total() != count; ++i)
      std::this_thread::sleep_for(milliseconds(1));
    return hub.open_requests.total() == count;
  }
  /// Whether the request is answered while the threads are held up. If not, its reply comes later.
  bool is_answered_at_once(const proto::Request& request, proto::Reply& reply) {
    const std::uint64_t id = client.send(request), marker = client.send(info_request());
    reply = client.receive().value_or(proto::Reply());
    if (reply.id() != id) {
      EXPECT_EQ(reply.id(), marker);
      return false;
    }
    EXPECT_EQ(client.receive().value_or(proto::Reply()).id(), marker);
    return true;
  }
  /// More than may be made on the transport's thread.
  static proto::Request long_edit(const std::string& session) {
    proto::Request request = move_request(session, 1, 0, 0.1, 0);
    for (int i = 0; i < 100; ++i)
      *request.mutable_edit()->add_edits() = proto::Edit(request.edit().edits(0));
    return request;
  }
  static std::string bytes_of(proto::Request request, std::uint64_t id, const std::string& name) {
    request.set_version(1);
    request.set_id(id);
    request.set_client(name);
    return request.SerializeAsString();
  }
  std::uint64_t revision(const std::string& session) {
    proto::Request request;
    request.mutable_get_session()->set_session(session);
    return client.call(request).get_session().status().revision();
  }

  Hub hub;
  Service service{hub, standard_kinds(hub.options), [] {}};
  std::promise<void> gate;
  bool held = false;
  Client client{hub.transport.request_endpoint()};
};

TEST_F(ServerService, EditsThatHideTheirSessionAreForThePool) {
  open_and_solve(client, "s");
  hold();
  proto::Reply reply;
  EXPECT_TRUE(is_answered_at_once(move_request("s", 1, 0, 0.1, 0), reply));
  EXPECT_TRUE(reply.has_edit());
  const std::string long_reference = "s@" + std::string(200, '0') + "7";
  EXPECT_FALSE(is_answered_at_once(move_request(long_reference, 1, 0, 0.1, 0), reply));
  release();
  reply = client.receive().value_or(proto::Reply());
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(reply.error().field(), "session");
}

/// A cantilever along x, unloaded.
proto::Request open_beams_request(const std::string& session, std::size_t elements) {
  proto::Request request;
  request.mutable_open_session()->set_session(session);
  auto* structure =
      request.mutable_open_session()->mutable_scene()->mutable_beams()->mutable_structure();
  auto* section = structure->add_sections();
  section->mutable_rectangle()->set_width(0.01);
  section->mutable_rectangle()->set_height(0.01);
  section->set_young(1e9);
  section->set_poisson(0.3);
  for (std::size_t i = 0; i <= elements; ++i)
    structure->add_nodes()->mutable_position()->set_x(0.1 * static_cast<double>(i));
  for (std::size_t i = 0; i < elements; ++i) {
    auto* element = structure->add_elements();
    element->set_start(static_cast<std::uint32_t>(i));
    element->set_finish(static_cast<std::uint32_t>(i + 1));
  }
  auto* support = structure->add_supports();
  support->set_fix_x(true);
  support->set_fix_y(true);
  support->set_fix_z(true);
  support->set_fix_rotation_x(true);
  support->set_fix_rotation_y(true);
  support->set_fix_rotation_z(true);
  return request;
}

TEST_F(ServerService, EditsOfLargeStructuresAreForThePool) {
  for (const auto& [name, elements] :
       {std::pair{"small", 20ul}, std::pair{"large", BeamRecord::kLightElements + 1}}) {
    const auto opened = client.call(open_beams_request(name, elements));
    ASSERT_TRUE(opened.has_open_session()) << opened.ShortDebugString();
  }
  const auto load = [](const std::string& session) {
    proto::Request request;
    request.mutable_edit()->set_session(session);
    auto* its = request.mutable_edit()->add_edits()->mutable_set_beam_load()->mutable_load();
    its->set_node(20);
    its->mutable_force()->set_z(-1e-6);
    return request;
  };
  hold();
  proto::Reply reply;
  EXPECT_TRUE(is_answered_at_once(load("small"), reply));
  EXPECT_TRUE(reply.has_edit()) << reply.ShortDebugString();
  EXPECT_FALSE(is_answered_at_once(load("large"), reply));
  release();
  reply = client.receive().value_or(proto::Reply());
  EXPECT_TRUE(reply.has_edit()) << reply.ShortDebugString();
}

proto::Request validation() {
  proto::Request request;
  *request.mutable_validate_scene()->mutable_scene() = small_scene();
  return request;
}

proto::Request geometry_of(const std::string& session) {
  proto::Request request;
  request.mutable_get_geometry()->set_session(session);
  return request;
}

TEST_F(ServerService, PatientRequestsHoldUpNoOthers) {
  open_and_solve(client, "s");
  hold({&hub.patient_request_pool});
  client.send(validation());
  proto::Request save;
  save.mutable_save_session()->set_session("s");
  client.send(save);
  ASSERT_TRUE(open_requests_become(2));
  EXPECT_TRUE(client.call(geometry_of("s")).has_get_geometry());
  EXPECT_TRUE(client.call(long_edit("s")).has_edit());
  EXPECT_TRUE(open_requests_become(2)) << "what was answered is closed";
  release();
  EXPECT_TRUE(client.receive() && client.receive()) << "their turn comes";
}

TEST_F(ServerService, PatientRequestsBehindEditsOfTheirSessionFindThemMade) {
  open_and_solve(client, "s");
  hold({&hub.request_pool});
  EXPECT_TRUE(client.call(validation()).has_validate_scene()) << "it is behind none";
  client.send(long_edit("s"));
  proto::Request save;
  save.mutable_save_session()->set_session("s");
  const std::uint64_t behind = client.send(save);
  ASSERT_TRUE(open_requests_become(2));
  release();
  const auto first = client.receive(), second = client.receive();
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(first->has_edit());
  EXPECT_EQ(second->id(), behind);
}

struct ServerServiceWithFewRequests : ServerService {
  static ServerOptions few() {
    ServerOptions options = test_options();
    options.limits.client_requests = 4;
    return options;
  }
  ServerServiceWithFewRequests() : ServerService(few()) {}
};

TEST_F(ServerServiceWithFewRequests, ARequestRefusedForLoadMayComeAgainUnderItsId) {
  hold();
  for (int i = 0; i < 4; ++i) client.send(validation());
  const std::string open = bytes_of(open_request(small_scene(), "s"), 1'000'001, "a client");
  client.send_bytes(open);
  const auto refused = client.receive();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->id(), 1'000'001u);
  EXPECT_EQ(refused->error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  release();
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(client.receive()->has_validate_scene());
  client.send_bytes(open);
  const auto opened = client.receive();
  ASSERT_TRUE(opened);
  EXPECT_TRUE(opened->has_open_session()) << opened->ShortDebugString();
}

TEST_F(ServerService, WhatWaitsOfAClientThatLeftIsDroppedAtOnce) {
  open_and_solve(client, "s");
  hold();
  auto gone = std::make_unique<Client>(hub.transport.request_endpoint());
  for (int i = 0; i < 100; ++i) gone->send(long_edit("s"));
  ASSERT_TRUE(open_requests_become(100));
  gone.reset();
  EXPECT_TRUE(open_requests_become(0));
  release();
  EXPECT_EQ(revision("s"), 0u);
}

TEST_F(ServerService, WhatAClientRepeatedBeforeItsConnectionEndedIsDoneOnceAndInOrder) {
  open_and_solve(client, "s");
  hold();
  auto gone = std::make_unique<Client>(hub.transport.request_endpoint());
  const std::string name = "a client that reconnects";
  for (const std::uint64_t id : {1ul, 2ul}) gone->send_bytes(bytes_of(long_edit("s"), id, name));
  gone->send_bytes(bytes_of(long_edit("s"), 7, name));  // not repeated: of no use to anybody
  ASSERT_TRUE(open_requests_become(3));
  for (const std::uint64_t id : {1ul, 2ul, 3ul}) {
    client.send_bytes(bytes_of(long_edit("s"), id, name));
    ASSERT_TRUE(open_requests_become(3 + id));
  }
  gone.reset();
  ASSERT_TRUE(open_requests_become(3));
  release();
  for (const std::uint64_t id : {1ul, 2ul, 3ul}) {
    const auto reply = client.receive();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->id(), id);
    EXPECT_EQ(reply->edit().revision(), id) << reply->ShortDebugString();
  }
  EXPECT_EQ(revision("s"), 3u);
}

}  // namespace
}  // namespace limber::server
