#include "server/service/scene_files.h"

#include <gtest/gtest.h>

#include <functional>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct BadScene {
  const char* field;
  std::function<void(proto::Scene&)> spoil;
};

const std::vector<BadScene>& bad_scenes() {
  static const std::vector<BadScene> kBad = {
      {"constraints[0].displacement",
       [](auto& s) { s.mutable_constraints(0)->mutable_displacement()->set_x(1e9); }},
      {"constraints[0].position",
       [](auto& s) { s.mutable_constraints(0)->mutable_position()->set_x(1e9); }},
      {"constraints[0].weight", [](auto& s) { s.mutable_constraints(0)->set_weight(1e-40); }},
      {"constraints[0].frame", [](auto& s) { s.mutable_constraints(0)->set_frame(20); }},
      {"constraints[0].nodes[0]", [](auto& s) { s.mutable_constraints(0)->set_nodes(0, 9999); }},
      {"constraints[0].target", [](auto& s) { s.mutable_constraints(0)->clear_target(); }},
      {"dynamics.frames_per_second",
       [](auto& s) { s.mutable_dynamics()->set_frames_per_second(1e20); }},
      {"dynamics.period_frames", [](auto& s) { s.mutable_dynamics()->set_period_frames(1e-9); }},
      {"frames", [](auto& s) { s.set_frames(4); }},
      {"fixed_nodes[0]", [](auto& s) { s.set_fixed_nodes(0, 9999); }},
      {"model.modes", [](auto& s) { s.mutable_model()->set_modes(0); }},
      {"model.basis_size",
       [](auto& s) {
         s.clear_fixed_nodes();
         s.mutable_model()->set_basis_size(2);
       }},
      {"mesh.sample", [](auto& s) { s.mutable_mesh()->set_sample("unicorn"); }},
      {"mesh.file",
       [](auto& s) {
         s.mutable_mesh()->mutable_file()->set_name("a.msh");
         s.mutable_mesh()->mutable_file()->set_content("nonsense");
       }},
      {"mesh.path", [](auto& s) { s.mutable_mesh()->set_path("none.msh"); }},
      {"material_groups[0].material.density",
       [](auto& s) {
         s.add_material_groups()->mutable_material()->set_density(-1);
         s.mutable_material_groups(0)->add_tets(0);
       }},
  };
  return kBad;
}

TEST(ServerSceneFiles, ValidationFindsWhatOpeningRefusesAndCallsItTheSame) {
  RunningServer server;
  Client client(server->request_endpoint());
  for (const auto& [field, spoil] : bad_scenes()) {
    proto::Scene scene = small_scene();
    spoil(scene);
    const auto opened = client.call(open_request(scene));
    EXPECT_EQ(opened.error().field(), std::string("scene.") + field) << opened.error().message();
    proto::Request request;
    *request.mutable_validate_scene()->mutable_scene() = scene;
    const auto issues = client.call(request).validate_scene().issues();
    int found = 0;
    for (const auto& issue : issues) {
      if (issue.severity() == proto::Issue::SEVERITY_ERROR)
        found += issue.field() == std::string("scene.") + field ? 1 : 0;
    }
    EXPECT_EQ(found, 1) << field;
  }
}

TEST(ServerSceneFiles, ASampleIsAskedForByName) {
  RunningServer server;
  Client client(server->request_endpoint());
  proto::Request request;
  request.mutable_get_sample()->set_name("unicorn");
  EXPECT_EQ(client.call(request).error().field(), "name");
}

TEST(ServerSceneFiles, MemoryIsPartOfValidation) {
  ServerOptions options = test_options();
  options.limits.session_bytes = 10'000;
  RunningServer server(options);
  Client client(server->request_endpoint());
  proto::Request request;
  *request.mutable_validate_scene()->mutable_scene() = small_scene();
  const auto issues = client.call(request).validate_scene().issues();
  ASSERT_FALSE(issues.empty());
  EXPECT_EQ(issues.rbegin()->severity(), proto::Issue::SEVERITY_ERROR);
  EXPECT_EQ(issues.rbegin()->field(), "scene");
}

}  // namespace
}  // namespace limber::server
