#include "server/service/export.h"

#include <gtest/gtest.h>

#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/point_cache.h"
#include "server/codec/scene_json.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerExport : ::testing::Test {
  RunningServer server;
  Client client{server->request_endpoint()};
  /// All parts put together, as a client does it.
  std::map<std::string, std::string> fetch(proto::ExportFormat format,
                                           std::uint32_t* parts = nullptr) {
    std::map<std::string, std::string> files;
    proto::Request request;
    request.mutable_export_()->set_session("s");
    request.mutable_export_()->set_format(format);
    request.mutable_export_()->set_stem("film");
    for (std::uint32_t part = 0, count = 1; part < count; ++part) {
      request.mutable_export_()->set_part(part);
      const auto reply = client.call(request);
      EXPECT_TRUE(reply.has_export_()) << reply.error().ShortDebugString();
      count = reply.export_().part_count();
      if (parts != nullptr) *parts = count;
      request.mutable_export_()->set_result_sequence(reply.export_().result().sequence());
      for (const auto& file : reply.export_().files()) {
        EXPECT_EQ(file.append(), files.count(file.name()) > 0) << file.name();
        files[file.name()] += file.content();
      }
    }
    return files;
  }
  Eigen::MatrixXf positions(int nodes) {
    proto::Request request;
    request.mutable_get_frames()->set_session("s");
    request.mutable_get_frames()->set_encoding(proto::ENCODING_POSITIONS);
    const auto frames = client.call(request).get_frames().frames();
    return Eigen::Map<const Eigen::MatrixXf>(
        reinterpret_cast<const float*>(frames.data().data().data()), 3 * nodes,
        frames.frame_count());
  }
};

TEST_F(ServerExport, PointCachesHoldTheFrames) {
  open_and_solve(client, "s");
  const auto files = fetch(proto::EXPORT_FORMAT_PC2);
  const auto cache = scene::read_pc2("film.pc2", files.at("film.pc2"));
  const Eigen::MatrixXf wanted = positions(28);
  ASSERT_EQ(cache.positions.cols(), wanted.cols());
  EXPECT_LT((cache.positions - wanted).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_EQ(files.at("film.obj").find("film"), std::string::npos);
}

TEST_F(ServerExport, LongMotionsComeInPartsOfOneResult) {
  open_and_solve(client, "s", small_scene(300, 2000));  // 1204 nodes: 29 MB
  std::uint32_t parts = 0;
  const auto files = fetch(proto::EXPORT_FORMAT_PC2, &parts);
  EXPECT_GE(parts, 2u);
  const auto cache = scene::read_pc2("film.pc2", files.at("film.pc2"));
  EXPECT_EQ(cache.sample_count(), 2000);
  // Parts after the first are of the result of the first, although there are newer ones.
  proto::Request request;
  request.mutable_export_()->set_session("s");
  request.mutable_export_()->set_format(proto::EXPORT_FORMAT_PC2);
  const auto begun = client.call(request).export_().result();
  ASSERT_TRUE(client.call(move_request("s", 1, 0, 0.3, 0)).has_edit());
  ASSERT_TRUE(client.call(wait_request("s", 1)).has_wait());
  request.mutable_export_()->set_part(1);
  request.mutable_export_()->set_result_sequence(begun.sequence());
  EXPECT_EQ(client.call(request).export_().result().revision(), 0u);
  request.mutable_export_()->set_result_sequence(99999);
  EXPECT_EQ(client.call(request).error().code(), proto::ERROR_CODE_FAILED_PRECONDITION);
  request.mutable_export_()->set_part(1000);
  request.mutable_export_()->set_result_sequence(0);
  EXPECT_EQ(client.call(request).error().field(), "part");
}

TEST_F(ServerExport, ParaViewGetsAFilePerFrame) {
  open_and_solve(client, "s");
  const auto files = fetch(proto::EXPORT_FORMAT_PVD);
  EXPECT_EQ(files.size(), 21u);
  const auto reading = scene::read_mesh({"f.vtu", files.at("film_00010.vtu"), {}});
  EXPECT_EQ(reading.mesh.tet_count(), 36);
  const Eigen::MatrixXf wanted = positions(28);
  const Eigen::Map<const Eigen::VectorXd> points(reading.mesh.nodes.data(),
                                                 reading.mesh.nodes.size());
  EXPECT_LT((points.cast<float>() - wanted.col(10)).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_NE(files.at("film.pvd").find("film_00019.vtu"), std::string::npos);
}

TEST_F(ServerExport, ScenesComeBackAsEdited) {
  open_and_solve(client, "s");
  ASSERT_TRUE(client.call(move_request("s", 1, 0, 0.25, 0)).has_edit());
  const auto files = fetch(proto::EXPORT_FORMAT_SCENE);
  proto::Scene scene = scene_from_json(files.at("film.json"));
  EXPECT_EQ(scene.constraints(0).displacement().y(), 0.25);
  EXPECT_EQ(scene.mesh().path(), "film.vtu");
  scene.mutable_mesh()->mutable_file()->set_name("film.vtu");
  scene.mutable_mesh()->mutable_file()->set_content(files.at("film.vtu"));
  EXPECT_TRUE(client.call(open_request(scene, "again")).has_open_session());
}

TEST_F(ServerExport, BadNamesAndFormats) {
  open_and_solve(client, "s");
  proto::Request request;
  request.mutable_export_()->set_session("s");
  EXPECT_EQ(client.call(request).error().field(), "format");
  request.mutable_export_()->set_format(proto::EXPORT_FORMAT_PVD);
  for (const char* stem : {"../x", "a/b", ".hidden", "x\ty", "\xc3\xa9"}) {
    request.mutable_export_()->set_stem(stem);
    EXPECT_EQ(client.call(request).error().field(), "stem") << stem;
  }
}

}  // namespace
}  // namespace limber::server
