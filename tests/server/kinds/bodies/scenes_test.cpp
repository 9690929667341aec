#include "server/kinds/bodies/scenes.h"

#include <gmock/gmock.h>

#include <functional>

#include "server/kinds/bodies/mesh_sources.h"
#include "server/kinds/bodies/scene_readers.h"
#include "server/runtime/file_roots.h"
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

struct ScenesOfManyFaults {
  const char* name;
  std::function<void(proto::Scene&)> spoil;
  std::vector<std::string> fields;
};

const std::vector<ScenesOfManyFaults>& scenes_of_many_faults() {
  static const std::vector<ScenesOfManyFaults> kScenes = {
      {"constraints, each with more than one",
       [](auto& s) {
         s.mutable_constraints(0)->set_nodes(0, 77777);
         s.mutable_constraints(0)->set_frame(500);
         s.mutable_constraints(0)->set_weight(1e-40);
         auto* empty = s.add_constraints();
         empty->set_frame(10);
         empty->add_axes(proto::AXIS_X);
         empty->add_axes(proto::AXIS_X);
         auto* far = s.add_constraints();
         far->set_frame(4'000'000'000);
         far->add_nodes(3'000'000'000);
         far->add_nodes(1);
         far->add_nodes(1);
         far->mutable_displacement()->set_x(1e9);
       },
       {"constraints[1].axes[1]", "constraints[1].target", "constraints[2].frame",
        "constraints[2].nodes[0]", "constraints[0].frame", "constraints[0].nodes[0]",
        "constraints[1].nodes", "constraints[2].nodes[2]", "constraints[0].weight",
        "constraints[2].displacement"}},
      {"no mesh, and what has nothing to do with it",
       [](auto& s) {
         s.mutable_mesh()->set_path("nope.msh");
         s.set_frames(2);
         s.mutable_material()->set_density(-1);
         s.mutable_constraints(0)->set_frame(1);
         s.mutable_constraints(0)->set_weight(-1);
         s.mutable_base_motion()->set_pc2("nonsense");
         s.add_material_groups()->add_tets(5);
         s.add_material_groups()->add_tets(5);
         s.mutable_material_groups(1)->mutable_material()->set_youngs_modulus(-1);
       },
       {"mesh.path", "material_groups[1].tets[0]", "base_motion.pc2", "material.density", "frames",
        "material_groups[1].material.youngs_modulus", "constraints[0].weight"}},
      {"groups",
       [](auto& s) {
         auto* first = s.add_material_groups();
         auto* second = s.add_material_groups();
         for (const int tet : {0, 1, 99999}) first->add_tets(static_cast<unsigned>(tet));
         for (const int tet : {1, 2, 88888}) second->add_tets(static_cast<unsigned>(tet));
         second->mutable_material()->set_youngs_modulus(-1);
       },
       {"material_groups[0].tets[2]", "material_groups[1].tets[0]", "material_groups[1].tets[2]",
        "material_groups[1].material.youngs_modulus"}},
      {"dynamics and model",
       [](auto& s) {
         s.mutable_dynamics()->set_period_frames(1e300);
         s.mutable_dynamics()->set_frames_per_second(1e-300);
         s.mutable_dynamics()->set_damping_ratio(1);
         s.mutable_model()->set_modes(4'000'000'000);
         s.mutable_model()->set_basis_size(4'000'000'000);
       },
       {"model.modes", "model.basis_size", "dynamics.damping_ratio", "dynamics.frames_per_second",
        "dynamics.period_frames"}},
      {"limits",
       [](auto& s) {
         s.set_frames(200'000);
         s.add_fixed_nodes(3'000'000'000);
         s.mutable_mesh()->clear_source();
       },
       {"frames", "fixed_nodes[4]", "mesh"}},
  };
  return kScenes;
}

TEST(ServerSceneFiles, EverythingThatIsWrongIsListedOnce) {
  RunningServer server;
  Client client(server->request_endpoint());
  for (const auto& [name, spoil, fields] : scenes_of_many_faults()) {
    proto::Scene scene = small_scene();
    spoil(scene);
    proto::Request request;
    *request.mutable_validate_scene()->mutable_scene() = scene;
    std::vector<std::string> found;
    const auto issues = client.call(request).validate_scene().issues();
    for (const auto& issue : issues) {
      if (issue.severity() == proto::Issue::SEVERITY_ERROR) found.push_back(issue.field());
      EXPECT_NE(issue.field(), "") << name << ": " << issue.message();
    }
    std::vector<std::string> expected;
    for (const auto& field : fields) expected.push_back("scene." + field);
    EXPECT_THAT(found, ::testing::UnorderedElementsAreArray(expected)) << name;
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(client.call(open_request(scene)).error().field(), found.front()) << name;
  }
}

TEST(ServerSceneFiles, MessagesDoNotRepeatTheirField) {
  RunningServer server;
  Client client(server->request_endpoint());
  std::vector<std::function<void(proto::Scene&)>> spoils;
  for (const auto& bad : bad_scenes()) spoils.push_back(bad.spoil);
  for (const auto& bad : scenes_of_many_faults()) spoils.push_back(bad.spoil);
  spoils.emplace_back([](auto& s) { s.mutable_base_motion()->set_pc2("nonsense"); });
  for (const auto& spoil : spoils) {
    proto::Scene scene = small_scene();
    spoil(scene);
    proto::Request request;
    *request.mutable_validate_scene()->mutable_scene() = scene;
    const auto issues = client.call(request).validate_scene().issues();
    EXPECT_GT(issues.size(), 0);
    for (const auto& issue : issues) {
      const std::string member = issue.field().substr(issue.field().rfind('.') + 1);
      EXPECT_FALSE(issue.message().starts_with(member + " is ") ||
                   issue.message().find(issue.field()) != std::string::npos)
          << issue.field() << ": " << issue.message();
    }
  }
}

TEST(ServerSceneFiles, WeightsSayHowToHoldExactly) {
  for (const double weight : {-1.0, 1e-40, 1e13}) {
    proto::Scene scene = small_scene();
    scene.mutable_constraints(0)->set_weight(weight);
    const auto issues = scene_issues(scene, "", {}, scene_readers(FileRoots({}).resolver()));
    ASSERT_EQ(issues.size(), 1u) << weight;
    EXPECT_THAT(issues[0].message(), ::testing::HasSubstr("`exact: true` (--exact)")) << weight;
  }
}

TEST(ServerSceneFiles, ListsOfFaultsEnd) {
  proto::Scene scene = small_scene();
  for (int i = 0; i < 100'000; ++i) scene.mutable_constraints(0)->add_nodes(3'000'000'000);
  for (int i = 0; i < 100'000; ++i) scene.add_fixed_nodes(3'000'000'000);
  RunningServer server;
  Client client(server->request_endpoint());
  proto::Request request;
  *request.mutable_validate_scene()->mutable_scene() = scene;
  const auto reply = client.call(request);
  EXPECT_GE(reply.validate_scene().issues_size(), 40);
  EXPECT_LE(reply.validate_scene().issues_size(), 100);
}

TEST(ServerSceneFiles, ASampleIsRequestedByName) {
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
