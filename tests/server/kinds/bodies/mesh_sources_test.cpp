#include "server/kinds/bodies/mesh_sources.h"

#include <gtest/gtest.h>

#include <fstream>

#include "engine/scene/formats/mesh_writers.h"
#include "server/kinds/bodies/scene.h"
#include "server/runtime/file_roots.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
namespace fs = std::filesystem;

struct MeshSourcesTest : ::testing::Test {
  TemporaryFolder folder;
  fs::path root = folder.path() / "meshes", outside = folder.path() / "outside";
  void SetUp() override {
    fs::create_directories(root / "deep");
    fs::create_directories(outside);
    const std::string bytes = scene::write_msh(decode_mesh(mesh_of(make_bar(2)), "mesh"));
    for (const auto& file : {root / "bar.msh", root / "deep" / "bar.msh", outside / "secret.msh"})
      std::ofstream(file) << bytes;
  }
  std::string outcome(const std::string& path) const {
    proto::MeshSource source;
    source.set_path(path);
    try {
      return std::to_string(
          mesh_loader(FileRoots({root}).resolver())(source, "scene.mesh").mesh.tet_count());
    } catch (const Refusal& refusal) {
      EXPECT_EQ(refusal.code(), proto::ERROR_CODE_NOT_FOUND);
      EXPECT_EQ(refusal.field(), "scene.mesh.path");
      return "refused";
    }
  }
};

TEST_F(MeshSourcesTest, FilesBelowTheRoot) {
  EXPECT_EQ(outcome("bar.msh"), "12");
  EXPECT_EQ(outcome("deep/bar.msh"), "12");
  EXPECT_EQ(outcome("deep/../bar.msh"), "12");
  EXPECT_EQ(outcome((root / "bar.msh").string()), "12");
}

TEST_F(MeshSourcesTest, NothingElse) {
  EXPECT_EQ(outcome("../outside/secret.msh"), "refused");
  EXPECT_EQ(outcome("deep/../../outside/secret.msh"), "refused");
  EXPECT_EQ(outcome((outside / "secret.msh").string()), "refused");
  EXPECT_EQ(outcome("missing.msh"), "refused");
  EXPECT_EQ(outcome("deep"), "refused");
  EXPECT_EQ(outcome(""), "refused");
  EXPECT_EQ(outcome(std::string("bar.msh\0x", 9)), "refused");
  EXPECT_EQ(outcome("/etc/passwd"), "refused");
}

TEST_F(MeshSourcesTest, SymbolicLinksDoNotLeadOut) {
  fs::create_symlink(outside / "secret.msh", root / "deep" / "link.msh");
  EXPECT_EQ(outcome("deep/link.msh"), "refused");
  fs::create_directory_symlink(outside, root / "door");
  EXPECT_EQ(outcome("door/secret.msh"), "refused");
  EXPECT_EQ(outcome("bar.msh"), "12");  // a link to a folder beside it harms nothing
}

TEST_F(MeshSourcesTest, CompanionsDoNotLeadOut) {
  std::ofstream(outside / "bar.elastic") << "secret";
  fs::create_symlink(outside / "bar.elastic", root / "deep" / "bar.elastic");
  EXPECT_EQ(outcome("deep/bar.msh"), "refused");
}

TEST_F(MeshSourcesTest, ALinkToTheRootItselfIsARoot) {
  fs::create_directory_symlink(root, folder.path() / "alias");
  proto::MeshSource source;
  source.set_path("bar.msh");
  EXPECT_EQ(
      mesh_loader(FileRoots({folder.path() / "alias"}).resolver())(source, "m").mesh.tet_count(),
      12);
}

TEST_F(MeshSourcesTest, OverTheWire) {
  ServerOptions options = test_options();
  options.mesh_roots = {root};
  RunningServer server(options);
  Client client(server->request_endpoint());
  proto::Scene scene = small_scene(2);
  scene.mutable_mesh()->set_path("deep/bar.msh");
  ASSERT_TRUE(client.call(open_request(scene, "s")).has_open_session());
  proto::Request request;
  request.mutable_get_session()->set_session("s");
  request.mutable_get_session()->set_with_scene(true);
  EXPECT_EQ(client.call(request).get_session().scene().mesh().path(), "deep/bar.msh");
  scene.mutable_mesh()->set_path("../outside/secret.msh");
  const auto refused = client.call(open_request(scene, "t"));
  EXPECT_EQ(refused.error().code(), proto::ERROR_CODE_NOT_FOUND);
  EXPECT_EQ(refused.error().field(), "scene.mesh.path");
  RunningServer without;
  Client other(without->request_endpoint());
  scene.mutable_mesh()->set_path("bar.msh");
  EXPECT_EQ(other.call(open_request(scene)).error().field(), "scene.mesh.path");
}

}  // namespace
}  // namespace limber::server
