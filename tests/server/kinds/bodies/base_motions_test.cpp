#include "server/kinds/bodies/base_motions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "engine/scene/formats/mesh_writers.h"
#include "engine/scene/formats/point_cache.h"
#include "server/wire/errors.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using ::testing::HasSubstr;

/// Four nodes, three frames.
struct Files {
  Eigen::MatrixXd positions = Eigen::MatrixXd::Random(12, 3).cast<float>().cast<double>();
  std::map<std::string, std::string> bytes;

  Files() {
    bodies::TetMesh mesh;
    mesh.nodes.setZero(3, 4);
    mesh.tets = Eigen::Vector4i(0, 1, 2, 3);
    for (int frame = 0; frame < 3; ++frame) {
      bytes["in/m_" + std::to_string(frame) + ".vtu"] =
          scene::write_vtu_frame(mesh, positions.col(frame), scene::Precision::kFloat64);
    }
    bytes["in/m.pvd"] = scene::write_pvd({"m_1.vtu", "m_2.vtu", "m_0.vtu"}, {0.1, 0.2, 0});
    scene::PointCache cache;
    cache.positions = positions.cast<float>();
    bytes["m.pc2"] = scene::write_pc2(cache);
  }
  Eigen::MatrixXd read(const proto::BaseMotion& motion, int nodes = 4) const {
    return read_base_motion(motion, "base_motion", nodes,
                            [&](const std::string& path, const std::string& field) {
                              const auto found = bytes.find(path);
                              if (found == bytes.end())
                                throw Error(ErrorCode::kIo, field, path + " is not there");
                              return found->second;
                            });
  }
  std::string refused(const proto::BaseMotion& motion, int nodes = 4) const {
    try {
      (void)read(motion, nodes);
    } catch (const Error& error) {
      return error.field() + ": " + error.what();
    } catch (const Refusal& refusal) {
      return refusal.field() + ": " + refusal.what();
    }
    return "accepted";
  }
};

void add(proto::VtuSeries& series, const std::string& name, const std::string& content) {
  series.add_files()->set_name(name);
  series.mutable_files(series.files_size() - 1)->set_content(content);
}

TEST(BaseMotions, EverySourceIsTheSameMotion) {
  const Files files;
  proto::BaseMotion motion;
  motion.set_path("m.pc2");
  EXPECT_EQ(files.read(motion), files.positions);
  motion.set_pc2(files.bytes.at("m.pc2"));
  EXPECT_EQ(files.read(motion), files.positions);
  motion.set_path("in/m.pvd");
  EXPECT_EQ(files.read(motion), files.positions);
  for (const char* name : {"in/m_0.vtu", "in/m_1.vtu", "in/m_2.vtu"})
    motion.mutable_vtu_series()->add_paths(name);
  EXPECT_EQ(files.read(motion), files.positions);
  motion.clear_vtu_series();
  for (const char* name : {"m_0.vtu", "m_1.vtu", "m_2.vtu"})
    add(*motion.mutable_vtu_series(), name, files.bytes.at(std::string("in/") + name));
  EXPECT_EQ(files.read(motion), files.positions);
  motion.mutable_vtu_series()->mutable_files()->SwapElements(0, 2);
  motion.mutable_vtu_series()->set_pvd(files.bytes.at("in/m.pvd"));
  EXPECT_EQ(files.read(motion), files.positions);
}

TEST(BaseMotions, RefusalsNameFieldFrameAndFile) {
  const Files files;
  proto::BaseMotion motion;
  motion.set_path("in/m.pvd");
  EXPECT_THAT(files.refused(motion, 5), HasSubstr("base_motion.path: frame 0 (in/m_0.vtu) has 4"));
  motion.set_path("m.vtu");
  EXPECT_THAT(files.refused(motion), HasSubstr("base_motion.path: 'm.vtu' is neither"));
  motion.set_path("gone.pc2");
  EXPECT_THAT(files.refused(motion), HasSubstr("base_motion.path: gone.pc2 is not there"));
  motion.set_pc2("nonsense");
  EXPECT_THAT(files.refused(motion), HasSubstr("base_motion.pc2: "));
  EXPECT_THAT(files.refused({}), HasSubstr("base_motion: "));
  auto& series = *motion.mutable_vtu_series();
  EXPECT_THAT(files.refused(motion), HasSubstr("base_motion.vtu_series.files: has no frames"));
  add(series, "m_0.vtu", files.bytes.at("in/m_0.vtu"));
  add(series, "m_1.vtu", "nonsense");
  EXPECT_THAT(files.refused(motion), HasSubstr("files: frame 1 (m_1.vtu): m_1.vtu:1"));
  series.set_pvd(files.bytes.at("in/m.pvd"));
  EXPECT_THAT(files.refused(motion), HasSubstr("lists m_2.vtu, which is not among the files"));
  series.set_pvd("nonsense");
  EXPECT_THAT(files.refused(motion), HasSubstr("base_motion.vtu_series.pvd: "));
  series.add_paths("x.vtu");
  EXPECT_THAT(files.refused(motion), HasSubstr("base_motion.vtu_series.paths: "));
  series.clear_paths();
  (*series.mutable_files(0)->mutable_companions())["a"] = "b";
  EXPECT_THAT(files.refused(motion), HasSubstr("files[0].companions"));
}

TEST(BaseMotions, PathsAreReadBelowTheMeshFoldersOnly) {
  const TemporaryFolder home, elsewhere;
  const Files files;
  for (const auto* folder : {&home, &elsewhere}) {
    std::ofstream out(folder->path() / "m.pc2", std::ios::binary);
    out << files.bytes.at("m.pc2");
  }
  ServerOptions options = test_options();
  options.mesh_roots = {home.path()};
  RunningServer server(options);
  Client client(server->request_endpoint());
  const auto issues = [&](const std::string& path) {
    proto::Request request;
    auto* scene = request.mutable_validate_scene()->mutable_scene();
    *scene = small_scene(6, 5);
    scene->clear_constraints();
    scene->mutable_base_motion()->set_path(path);
    const auto reply = client.call(request).validate_scene();
    return reply.issues_size() == 1 ? reply.issues(0) : proto::Issue();
  };
  const auto found = issues("m.pc2");  // four nodes, whereas the mesh has more
  EXPECT_EQ(found.field(), "scene.base_motion.path");
  EXPECT_THAT(found.message(), HasSubstr("has 4 nodes, the mesh has 28"));
  for (const std::string& path : {(elsewhere.path() / "m.pc2").string(), std::string("../m.pc2")}) {
    EXPECT_EQ(issues(path).code(), proto::ERROR_CODE_NOT_FOUND);
    EXPECT_EQ(issues(path).field(), "scene.base_motion.path");
  }
}

}  // namespace
}  // namespace limber::server
