#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using namespace limber::server::testing;

struct ServerRequests : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};
  proto::Error error_of(const std::string& bytes) {
    client.send_bytes(bytes);
    const auto reply = client.receive();
    EXPECT_TRUE(reply && reply->has_error());
    return reply ? reply->error() : proto::Error();
  }
};

TEST_F(ServerRequests, OtherVersionsAreUnsupported) {
  for (const std::uint32_t version : {0u, 2u, 4000000000u}) {
    proto::Request request = info_request();
    request.set_version(version);
    request.set_id(77);
    client.send_bytes(request.SerializeAsString());
    const auto reply = client.receive();
    ASSERT_TRUE(reply.has_value());
    EXPECT_EQ(reply->id(), 77u);
    EXPECT_EQ(reply->error().code(), proto::ERROR_CODE_UNSUPPORTED);
    EXPECT_EQ(reply->error().field(), "version");
    EXPECT_EQ(reply->error().details().at("supported"), "1");
  }
}

TEST_F(ServerRequests, UnknownFieldsAndBodies) {
  proto::Request request = info_request();
  request.set_version(1);
  request.GetReflection()->MutableUnknownFields(&request)->AddVarint(99, 1);
  proto::Error error = error_of(request.SerializeAsString());
  EXPECT_EQ(error.code(), proto::ERROR_CODE_UNSUPPORTED);
  EXPECT_THAT(error.message(), HasSubstr("unknown field number 99 in Request"));
  request.Clear();
  request.set_version(1);
  error = error_of(request.SerializeAsString());
  EXPECT_EQ(error.field(), "body");
}

TEST_F(ServerRequests, StringsThatAreNotUtf8AreMalformed) {
  proto::Request request = wait_request("abcd", 1);
  request.set_version(1);
  std::string bytes = request.SerializeAsString();
  bytes.replace(bytes.find("abcd"), 4, "\xff\xfe\xc0\x80");
  EXPECT_EQ(error_of(bytes).code(), proto::ERROR_CODE_MALFORMED);
  EXPECT_EQ(server->counters().malformed.load(), 1u);
}

TEST_F(ServerRequests, ThingsThatDoNotExist) {
  std::vector<proto::Request> requests{wait_request("none", 1), move_request("none", 1, 0, 0, 0)};
  requests.emplace_back().mutable_get_session()->set_session("none");
  requests.emplace_back().mutable_close_session()->set_session("none");
  requests.emplace_back().mutable_get_geometry()->set_session("none");
  requests.emplace_back().mutable_get_frames()->set_session("none");
  requests.emplace_back().mutable_solve_cold()->set_session("none");
  requests.emplace_back().mutable_export_()->set_session("none");
  requests.emplace_back().mutable_cancel()->set_session("none");
  for (const auto& request : requests) {
    const auto reply = client.call(request);
    EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_NOT_FOUND) << request.ShortDebugString();
    EXPECT_EQ(reply.error().field(), "session");
  }
  proto::Request request;
  request.mutable_get_job()->set_job(5);
  EXPECT_EQ(client.call(request).error().field(), "job");
  request.mutable_get_sample()->set_name("unicorn");
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_NOT_FOUND);
  request.mutable_cancel();
  EXPECT_EQ(client.call(request).error().field(), "target");
}

TEST_F(ServerRequests, BadScenesAreRefusedWithTheirPlace) {
  proto::ErrorCode code{};
  const auto field = [&](const proto::Scene& scene) {
    const auto reply = client.call(open_request(scene, "bad"));
    EXPECT_TRUE(reply.has_error());
    code = reply.error().code();
    proto::Request validate;
    *validate.mutable_validate_scene()->mutable_scene() = scene;
    const auto issues = client.call(validate).validate_scene().issues();
    EXPECT_TRUE(std::any_of(issues.begin(), issues.end(),
                            [&](const proto::Issue& issue) {
                              return issue.field() == reply.error().field() && issue.code() == code;
                            }))
        << "validate_scene and open_session differ on " << reply.error().field();
    return reply.error().field();
  };
  proto::Scene scene = small_scene();
  scene.set_frames(0);
  EXPECT_EQ(field(scene), "scene.frames");
  EXPECT_EQ(code, proto::ERROR_CODE_INVALID_ARGUMENT);
  scene = small_scene();
  scene.mutable_model()->set_modes(0);
  EXPECT_THAT(field(scene), HasSubstr("scene.model"));
  EXPECT_EQ(code, proto::ERROR_CODE_INVALID_ARGUMENT);
  scene = small_scene();
  scene.mutable_constraints(0)->set_frame(20);
  EXPECT_EQ(field(scene), "scene.constraints[0].frame");
  EXPECT_EQ(code, proto::ERROR_CODE_OUT_OF_RANGE);
  scene = small_scene();
  scene.mutable_constraints(0)->set_nodes(0, 1000);
  EXPECT_EQ(field(scene), "scene.constraints[0].nodes[0]");
  EXPECT_EQ(code, proto::ERROR_CODE_OUT_OF_RANGE);
  scene = small_scene();
  *scene.add_constraints() = scene.constraints(0);
  EXPECT_EQ(field(scene), "scene.constraints[1].id");
  EXPECT_EQ(code, proto::ERROR_CODE_ALREADY_EXISTS);
  scene = small_scene();
  scene.mutable_constraints(0)->set_weight(-1);
  EXPECT_EQ(field(scene), "scene.constraints[0].weight");
  EXPECT_EQ(code, proto::ERROR_CODE_INVALID_ARGUMENT);
  scene.mutable_constraints(0)->set_weight(1e13);
  EXPECT_EQ(field(scene), "scene.constraints[0].weight");
  EXPECT_EQ(code, proto::ERROR_CODE_OUT_OF_RANGE);
  scene.mutable_constraints(0)->set_weight(1e-40);
  EXPECT_EQ(field(scene), "scene.constraints[0].weight");
  EXPECT_EQ(code, proto::ERROR_CODE_OUT_OF_RANGE);
  scene = small_scene();
  scene.add_fixed_nodes(1000);
  EXPECT_THAT(field(scene), HasSubstr("scene.fixed_nodes"));
  EXPECT_EQ(code, proto::ERROR_CODE_OUT_OF_RANGE);
  scene = small_scene();
  scene.mutable_mesh()->mutable_file()->set_name("x.msh");
  scene.mutable_mesh()->mutable_file()->set_content("$MeshFormat\n2.2 0 8\n");
  EXPECT_FALSE(field(scene).empty());
  EXPECT_EQ(client.call(open_request(small_scene(), "bad name!")).error().field(), "session");
  EXPECT_EQ(client.call(open_request(small_scene(), std::string(65, 'a'))).error().field(),
            "session");
  // Nothing of all that is left behind: the name is free.
  EXPECT_TRUE(client.call(open_request(small_scene(), "bad")).has_open_session());
}

TEST_F(ServerRequests, ValidateListsEverything) {
  proto::Request request;
  *request.mutable_validate_scene()->mutable_scene() = small_scene();
  EXPECT_EQ(client.call(request).validate_scene().issues_size(), 0);
  request.mutable_validate_scene()->mutable_scene()->mutable_constraints(0)->set_frame(99);
  request.mutable_validate_scene()->mutable_scene()->mutable_model()->set_modes(0);
  const auto reply = client.call(request);
  ASSERT_GE(reply.validate_scene().issues_size(), 2);
  for (const auto& issue : reply.validate_scene().issues())
    EXPECT_EQ(issue.field().rfind("scene.", 0), 0u) << issue.field();
}

std::vector<std::string> valid_messages() {
  std::vector<proto::Request> requests{info_request(), wait_request("s", 1, 0.01),
                                       move_request("s", 1, 0, 0.1, 0),
                                       open_request(small_scene(1, 3), "s")};
  requests.emplace_back().mutable_list_jobs();
  requests.emplace_back().mutable_list_sessions();
  requests.emplace_back().mutable_get_session()->set_session("s");
  requests.emplace_back().mutable_get_frames()->set_session("s");
  requests.emplace_back().mutable_get_geometry()->set_session("s");
  requests.emplace_back().mutable_export_()->set_session("s");
  requests.emplace_back().mutable_get_job()->set_job(1);
  requests.emplace_back().mutable_tetrahedralize()->mutable_surface()->set_name("a.obj");
  *requests.emplace_back().mutable_validate_scene()->mutable_scene() = small_scene(1, 3);
  std::vector<std::string> bytes;
  for (auto& request : requests) {
    request.set_version(1);
    bytes.push_back(request.SerializeAsString());
  }
  return bytes;
}

std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  for (std::size_t changes = 1 + below(4); changes > 0 && !bytes.empty(); --changes) {
    switch (below(5)) {
      case 0:
        bytes[below(bytes.size())] = static_cast<char>(below(256));
        break;
      case 1:
        bytes.resize(below(bytes.size() + 1));
        break;
      case 2:
        bytes.insert(below(bytes.size() + 1), 1, static_cast<char>(below(256)));
        break;
      case 3:
        bytes.erase(below(bytes.size()), 1 + below(8));
        break;
      default:
        bytes[below(bytes.size())] ^= static_cast<char>(1 << below(8));
        break;
    }
  }
  return bytes;
}

/// Every message is answered, for any input; nothing crashes, hangs or is answered twice.
TEST_F(ServerRequests, RandomAndMutatedBytesAreAllAnswered) {
  std::mt19937 random(12345);
  const auto valid = valid_messages();
  constexpr int kRounds = 60, kBatch = 100;
  int errors = 0;
  for (int round = 0; round < kRounds; ++round) {
    for (int i = 0; i < kBatch; ++i) {
      std::string bytes;
      if (i % 4 == 0) {
        bytes.resize(random() % 200);
        for (auto& byte : bytes) byte = static_cast<char>(random());
      } else {
        bytes = mutated(valid[random() % valid.size()], random);
      }
      // A mutation may ask for the end of the server; that is tested elsewhere.
      proto::Request parsed;
      if (parsed.ParseFromString(bytes) && parsed.has_shutdown()) bytes.clear();
      client.send_bytes(bytes);
    }
    for (int i = 0; i < kBatch; ++i) {
      const auto reply = client.receive();
      ASSERT_TRUE(reply.has_value()) << "round " << round;
      errors += reply->has_error() ? 1 : 0;
      EXPECT_NE(reply->error().code(), proto::ERROR_CODE_INTERNAL) << reply->error().message();
    }
  }
  EXPECT_FALSE(client.receive(milliseconds(50)).has_value());
  EXPECT_EQ(server->counters().requests.load(), static_cast<std::uint64_t>(kRounds * kBatch));
  EXPECT_EQ(server->counters().replies.load(), static_cast<std::uint64_t>(kRounds * kBatch));
  EXPECT_GT(errors, kRounds * kBatch / 2);
  EXPECT_GT(server->counters().malformed.load(), 500u);
}

}  // namespace
}  // namespace limber::server
