#include "server/service/roles.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/server/support/curve_client.h"
#include "tests/server/support/page.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
namespace fs = std::filesystem;

const std::vector<Role> kRoles{Role::kView, Role::kEdit, Role::kAdminister};

std::vector<int> all_bodies() {
  std::vector<int> bodies;
  const auto* oneof = proto::Request::descriptor()->FindOneofByName("body");
  for (int i = 0; i < oneof->field_count(); ++i) bodies.push_back(oneof->field(i)->number());
  return bodies;
}

/// A request of this kind without anything in it.
proto::Request empty_request(int body) {
  proto::Request request;
  request.GetReflection()->MutableMessage(&request,
                                          proto::Request::descriptor()->FindFieldByNumber(body));
  return request;
}

TEST(Roles, EveryRequestHasOne) {
  EXPECT_GE(all_bodies().size(), 38u);
  for (const int body : all_bodies()) EXPECT_TRUE(least_role(body).has_value()) << body;
  EXPECT_FALSE(least_role(0).has_value());
  EXPECT_FALSE(least_role(99).has_value());
}

TEST(Roles, WhoLooksChangesNothing) {
  // Those that leave something behind, by their names: none of them is for those that look.
  for (const int body : all_bodies()) {
    const std::string name = proto::Request::descriptor()->FindFieldByNumber(body)->name();
    const bool reads = name.starts_with("get_") || name.starts_with("list_") || name == "wait" ||
                       name == "export" || name == "explain" || name == "look_at" ||
                       name == "save_session" || name == "join_session" ||
                       name == "leave_session" || name == "follow";
    EXPECT_EQ(*least_role(body) == Role::kView, reads && name != "list_allowed") << name;
  }
}

TEST(Roles, AreOrderedAndNamed) {
  for (const Role role : kRoles) {
    EXPECT_EQ(role_of(name_of(role)), role);
    EXPECT_EQ(from_proto(to_proto(role)), role);
  }
  EXPECT_FALSE(role_of("") || role_of("View") || role_of("admin"));
  EXPECT_FALSE(from_proto(proto::ROLE_UNSPECIFIED));
  EXPECT_NO_THROW(demand_role(Role::kEdit, proto::Request::kEdit));
  try {
    demand_role(Role::kView, proto::Request::kEdit);
    FAIL() << "let in";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_PERMISSION_DENIED);
    EXPECT_STREQ(refusal.what(),
                 "the request edit needs the role edit; this client has the role view");
    EXPECT_EQ(refusal.details().at("needs"), "edit");
    EXPECT_EQ(refusal.details().at("has"), "view");
  }
}

/// A server with CURVE keys, and a client of each role.
class AccessTest : public ::testing::Test {
 protected:
  AccessTest() {
    std::ofstream file(list_);
    for (const Role role : kRoles)
      file << of(role).public_key << " " << name_of(role) << " the-" << name_of(role) << "\n";
    file.close();
    ServerOptions options = test_options();
    options.transport.curve = CurveSetup{server_keys_, read_allowed_keys(list_), list_};
    options.status_interval = milliseconds(20);
    web::Options pages;
    pages.address = "127.0.0.1:0";
    server_.emplace(std::move(options), pages);
  }
  [[nodiscard]] const CurveKeys& of(Role role) const {
    return keys_[static_cast<std::size_t>(role)];
  }
  [[nodiscard]] CurveClient client(const CurveKeys& keys) {
    return {server()->request_endpoint(), keys, server_keys_.public_key};
  }
  [[nodiscard]] CurveClient client(Role role) { return client(of(role)); }
  RunningServer& server() { return *server_; }

  static proto::Request revoke(const std::string& key) {
    proto::Request request;
    request.mutable_revoke()->set_key(key);
    return request;
  }
  static proto::Request allow(const std::string& key, proto::Role role,
                              const std::string& name = "") {
    proto::Request request;
    auto& entry = *request.mutable_allow()->mutable_key();
    entry.set_key(key);
    entry.set_role(role);
    entry.set_name(name);
    return request;
  }

  const TemporaryFolder folder_;
  const fs::path list_ = folder_.path() / "allowed";
  const CurveKeys server_keys_ = make_curve_keys();
  const std::vector<CurveKeys> keys_{make_curve_keys(), make_curve_keys(), make_curve_keys()};
  std::optional<RunningServer> server_;
};

TEST_F(AccessTest, EveryRequestIsRefusedWithoutItsRole) {
  for (const Role role : kRoles) {
    auto asking = client(role);
    for (const int body : all_bodies()) {
      const auto reply = asking.call(empty_request(body));
      const bool is_denied = reply.error().code() == proto::ERROR_CODE_PERMISSION_DENIED;
      EXPECT_EQ(is_denied, role < *least_role(body))
          << name_of(role) << ": " << body << " " << reply.ShortDebugString();
    }
  }
}

TEST_F(AccessTest, WhoLooksSeesAndTouchesNothing) {
  auto editing = client(Role::kEdit), looking = client(Role::kView);
  ASSERT_TRUE(editing.call(open_request(small_scene(), "s")).has_open_session());
  ASSERT_TRUE(looking.call(wait_request("s", 0)).has_wait());
  const auto move = move_request("s", 1, 0, 0, 0.1);
  const auto refused = looking.call(move);
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_EQ(refused.error().field(), "edit");
  EXPECT_EQ(refused.error().details().at("needs"), "edit");
  EXPECT_NE(editing.call(move).body_case(), proto::Reply::BODY_NOT_SET);
  proto::Request frames;
  frames.mutable_get_frames()->set_session("s");
  frames.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);
  EXPECT_TRUE(looking.call(frames).has_get_frames());
}

TEST_F(AccessTest, AChangeCountsAtOnce) {
  auto changing = client(Role::kAdminister), looking = client(Role::kView);
  ASSERT_TRUE(client(Role::kEdit).call(open_request(small_scene(), "s")).has_open_session());
  proto::Request close;
  close.mutable_close_session()->set_session("s");
  EXPECT_EQ(looking.call(close).error().code(), proto::ERROR_CODE_PERMISSION_DENIED);
  const auto changed = changing.call(allow(of(Role::kView).public_key, proto::ROLE_EDIT));
  ASSERT_TRUE(changed.has_allow()) << changed.ShortDebugString();
  EXPECT_EQ(changed.allow().before().role(), proto::ROLE_VIEW);
  EXPECT_EQ(changed.allow().key().name(), "the-view");  // which it had
  EXPECT_EQ(looking.call(info_request()).get_server_info().role(), proto::ROLE_EDIT);
  EXPECT_TRUE(looking.call(close).has_close_session());
  EXPECT_EQ(read_allowed_keys(list_).at(of(Role::kView).public_key),
            (Allowed{Role::kEdit, "the-view"}));
  const auto listed = changing.call(empty_request(proto::Request::kListAllowed));
  ASSERT_EQ(listed.list_allowed().keys_size(), 3);
  EXPECT_EQ(listed.list_allowed().keys(0).role(), proto::ROLE_EDIT);
}

TEST_F(AccessTest, WhoIsNewIsLetIn) {
  const CurveKeys fresh = make_curve_keys();
  auto changing = client(Role::kAdminister);
  EXPECT_FALSE(client(fresh).ask(info_request(), milliseconds(300)));
  ASSERT_TRUE(changing.call(allow(fresh.public_key, proto::ROLE_VIEW, "hall")).has_allow());
  EXPECT_EQ(client(fresh).call(info_request()).get_server_info().role(), proto::ROLE_VIEW);
}

TEST_F(AccessTest, TheRevokedAreCutOffWithTheirStreams) {
  auto changing = client(Role::kAdminister), asking = client(Role::kEdit);
  ASSERT_TRUE(asking.call(open_request(small_scene(), "s")).has_open_session());
  zmq::context_t context;
  zmq::socket_t stream(context, ZMQ_SUB);
  stream.set(zmq::sockopt::linger, 0);
  use_keys(stream, of(Role::kEdit), server_keys_.public_key);
  stream.set(zmq::sockopt::subscribe, "session/s/status");
  stream.connect(server()->stream_endpoint());
  // The status comes fifty times a second.
  const auto hears = [&](milliseconds time) {
    stream.set(zmq::sockopt::rcvtimeo, static_cast<int>(time.count()));
    zmq::message_t topic, message;
    return stream.recv(topic).has_value() && stream.recv(message).has_value();
  };
  ASSERT_TRUE(hears(milliseconds(10000)));
  // A wait that nobody will answer is released, too.
  const auto revoked = changing.call(revoke("the-edit"));
  ASSERT_TRUE(revoked.has_revoke()) << revoked.ShortDebugString();
  EXPECT_EQ(revoked.revoke().key().key(), of(Role::kEdit).public_key);
  EXPECT_FALSE(asking.ask(info_request(), milliseconds(1000)));
  int heard = 0;
  while (heard < 1000 && hears(milliseconds(1000))) ++heard;
  EXPECT_LT(heard, 1000) << "what was under way may come, and no more";
  EXPECT_GE(server()->counters().cut_off.load(), 2u);
  EXPECT_FALSE(client(Role::kEdit).ask(info_request(), milliseconds(300)));
  EXPECT_FALSE(read_allowed_keys(list_).contains(of(Role::kEdit).public_key));
  EXPECT_TRUE(changing.call(info_request()).has_get_server_info());
  // And back again.
  ASSERT_TRUE(changing.call(allow(of(Role::kEdit).public_key, proto::ROLE_EDIT)).has_allow());
  EXPECT_TRUE(client(Role::kEdit).call(info_request()).has_get_server_info());
}

TEST_F(AccessTest, WhoReadTheListBeforeAChangeDoesNotUndoIt) {
  const AllowedKeys read_before = read_allowed_keys(list_);
  ASSERT_TRUE(client(Role::kAdminister).call(revoke("the-edit")).has_revoke());
  server()->allow(read_before);
  EXPECT_FALSE(client(Role::kEdit).ask(info_request(), milliseconds(300)));
  EXPECT_TRUE(client(Role::kView).call(info_request()).has_get_server_info());
  std::ofstream(list_) << "no list\n";
  EXPECT_THROW(server()->allow(read_before), Error);
  EXPECT_TRUE(client(Role::kView).call(info_request()).has_get_server_info());
}

TEST_F(AccessTest, NobodyLocksEverybodyOut) {
  auto changing = client(Role::kAdminister);
  const std::string own = of(Role::kAdminister).public_key;
  const auto code = [&](const proto::Request& request) {
    return changing.call(request).error().code();
  };
  EXPECT_EQ(code(revoke(own)), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(code(revoke("the-administer")), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(code(allow(own, proto::ROLE_EDIT)), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(code(allow(own, proto::ROLE_ADMINISTER, "ana")), proto::ERROR_CODE_UNSPECIFIED);
  // A page that administers has no key of its own.
  Page page(server()->web(), "/v1/requests");
  page.ask(revoke("ana"));
  EXPECT_EQ(page.reply().error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_EQ(read_allowed_keys(list_).size(), 3u);
}

TEST_F(AccessTest, WrongChangesNameTheirField) {
  auto changing = client(Role::kAdminister);
  const auto refusal = [&](const proto::Request& request) {
    const auto reply = changing.call(request);
    return proto::ErrorCode_Name(reply.error().code()) + " " + reply.error().field();
  };
  const std::string key = make_curve_keys().public_key;
  EXPECT_EQ(refusal(revoke("nobody")), "ERROR_CODE_NOT_FOUND key");
  EXPECT_EQ(refusal(revoke("")), "ERROR_CODE_NOT_FOUND key");
  EXPECT_EQ(refusal(allow("short", proto::ROLE_VIEW)), "ERROR_CODE_INVALID_ARGUMENT key.key");
  EXPECT_EQ(refusal(allow(key, proto::ROLE_UNSPECIFIED)), "ERROR_CODE_INVALID_ARGUMENT key.role");
  EXPECT_EQ(refusal(allow(key, proto::ROLE_VIEW, "a b")), "ERROR_CODE_INVALID_ARGUMENT key.name");
  EXPECT_EQ(refusal(allow(key, proto::ROLE_VIEW, "the-edit")),
            "ERROR_CODE_ALREADY_EXISTS key.name");
  EXPECT_EQ(read_allowed_keys(list_).size(), 3u);
  std::ofstream(list_, std::ios::app) << "a line by somebody else\n";
  EXPECT_EQ(refusal(allow(key, proto::ROLE_VIEW)),
            "ERROR_CODE_INVALID_ARGUMENT " + list_.string() + ":4");
}

TEST_F(AccessTest, ATokenHasARole) {
  for (const Role role : kRoles) {
    const auto info = client(role).call(info_request()).get_server_info();
    EXPECT_EQ(info.role(), to_proto(role));
    EXPECT_EQ(info.web_tokens_size(), static_cast<int>(role) + 1);
    EXPECT_EQ(info.web_token(), info.web_tokens(info.web_tokens_size() - 1).token());
    Page page({info.web(), info.web_token(), {}}, "/v1/requests");
    page.ask(info_request());
    const auto of_page = page.reply().get_server_info();
    EXPECT_EQ(of_page.role(), to_proto(role));
    EXPECT_EQ(of_page.web_tokens_size(), 0);
    page.ask(empty_request(proto::Request::kEdit));
    EXPECT_EQ(page.reply().error().code() == proto::ERROR_CODE_PERMISSION_DENIED,
              role == Role::kView);
    page.ask(empty_request(proto::Request::kShutdown));
    EXPECT_EQ(page.reply().error().code() == proto::ERROR_CODE_PERMISSION_DENIED,
              role != Role::kAdminister);
  }
}

TEST(Access, WithoutKeysEverybodyAdministers) {
  RunningServer server;
  Client client(server->request_endpoint());
  EXPECT_EQ(client.call(info_request()).get_server_info().role(), proto::ROLE_ADMINISTER);
  const auto refused = client.call(empty_request(proto::Request::kListAllowed));
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  EXPECT_NE(refused.error().message().find("--curve-allow"), std::string::npos);
}

}  // namespace
}  // namespace limber::server
