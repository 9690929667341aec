#include "server/kinds/bodies/export.h"

#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "engine/scene/formats/line_formats.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/point_cache.h"
#include "engine/scene/formats/surface_formats.h"
#include "server/wire/scene_json.h"
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
  const Eigen::MatrixXf has_subscriber = positions(28);
  ASSERT_EQ(cache.positions.cols(), has_subscriber.cols());
  EXPECT_LT((cache.positions - has_subscriber).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_EQ(files.at("film.obj").find("film"), std::string::npos);
}

TEST_F(ServerExport, BlenderGetsVerticesOfTheSurfaceAloneInOneOrder) {
  open_and_solve(client, "s", small_scene(3, 20));
  const auto files = fetch(proto::EXPORT_FORMAT_BLENDER);
  ASSERT_EQ(files.size(), 2u);
  std::set<int> of_faces;
  std::vector<std::array<double, 3>> vertices;
  std::istringstream lines(files.at("film_surface.obj"));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      std::array<double, 3> point{};
      words >> point[0] >> point[1] >> point[2];
      vertices.push_back(point);
    }
    for (int vertex = 0; word == "f" && words >> vertex;) of_faces.insert(vertex - 1);
  }
  ASSERT_FALSE(vertices.empty());
  EXPECT_EQ(of_faces.size(), vertices.size());
  EXPECT_EQ(*of_faces.rbegin() + 1, static_cast<int>(vertices.size()));
  const auto cache = scene::read_pc2("film.pc2", files.at("film_surface.pc2"));
  ASSERT_EQ(cache.positions.rows(), static_cast<Eigen::Index>(3 * vertices.size()));
  // The first frame is the shape at rest.
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(cache.positions(static_cast<Eigen::Index>(3 * k) + axis, 0),
                  vertices[k][static_cast<std::size_t>(axis)], 1e-6);
  }
  EXPECT_GT((cache.positions.col(10) - cache.positions.col(0)).norm(), 1e-3f);  // the ends are held
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
  const Eigen::MatrixXf has_subscriber = positions(28);
  const Eigen::Map<const Eigen::VectorXd> points(reading.mesh.nodes.data(),
                                                 reading.mesh.nodes.size());
  EXPECT_LT((points.cast<float>() - has_subscriber.col(10)).cwiseAbs().maxCoeff(), 1e-6f);
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

proto::Scene linkage_scene(const std::string& sample) {
  proto::Scene scene;
  auto& linkage = *scene.mutable_linkage();
  linkage.mutable_lines()->set_sample(sample);
  linkage.mutable_section()->mutable_rectangle()->set_width(0.02);
  linkage.mutable_section()->mutable_rectangle()->set_height(0.005);
  linkage.set_edges_per_segment(5);
  return scene;
}

struct LinkageExport : ServerExport {
  std::uint32_t steps = 0;
  void SetUp() override {
    ASSERT_TRUE(client.call(open_request(linkage_scene("grid"), "s")).has_open_session());
    proto::Request deploy;
    deploy.mutable_edit()->set_session("s");
    deploy.mutable_edit()->add_edits()->mutable_set_mean_angle()->set_angle_degrees(40);
    ASSERT_TRUE(client.call(deploy).has_edit());
    const auto result = client.call(wait_request("s", 1)).wait().result();
    ASSERT_FALSE(result.solve_failed()) << result.message();
    steps = result.linkage().steps();
  }
};

TEST_F(LinkageExport, AFilePerStepWithWhatTheRodsCarry) {
  const auto files = fetch(proto::EXPORT_FORMAT_VTP);
  ASSERT_GT(steps, 3u);
  EXPECT_EQ(files.size(), steps + 1);
  const std::string& last = files.at(fmt::format("film_{:05}.vtp", steps - 1));
  for (const char* name : {"axial_force", "curvature_2", "twist_rate", "bending_moment_1", "torque",
                           "von_mises_stress", "opening_angles", "segment_von_mises_stress"})
    EXPECT_NE(last.find(fmt::format("Name=\"{}\"", name)), std::string::npos) << name;
  EXPECT_NE(files.at("film.pvd").find(fmt::format("film_{:05}.vtp", steps - 1)), std::string::npos);
}

TEST_F(LinkageExport, CentrelinesAndSurfaceAreReadAgain) {
  const auto files = fetch(proto::EXPORT_FORMAT_OBJ);
  const auto lines = scene::read_line_mesh("a.obj", files.at("film_centrelines.obj"));
  const auto surface = scene::read_surface("a.obj", files.at("film_surface.obj"));
  proto::Request request;
  request.mutable_get_geometry()->set_session("s");
  const auto geometry = client.call(request).get_geometry().linkage();
  EXPECT_EQ(lines.edge_count(), geometry.edges_size() * 5);
  EXPECT_EQ(surface.vertices.cols(), geometry.surface_nodes());
  const Eigen::MatrixXf nodes = positions(static_cast<int>(geometry.surface_nodes()));
  const Eigen::Map<const Eigen::VectorXd> written(surface.vertices.data(), surface.vertices.size());
  EXPECT_LT((written.cast<float>() - nodes.rightCols<1>()).cwiseAbs().maxCoeff(), 1e-6f);
}

TEST_F(LinkageExport, JsonIsOfTheFinalShape) {
  const auto files = fetch(proto::EXPORT_FORMAT_JSON);
  google::protobuf::Struct shape;  // any JSON object
  ASSERT_TRUE(
      google::protobuf::util::JsonStringToMessage(files.at("film_shape.json"), &shape).ok());
  const auto& fields = shape.fields();
  EXPECT_NEAR(fields.at("mean_opening_angle").number_value(), 40, 1e-6);
  EXPECT_EQ(fields.at("units").struct_value().fields().at("von_mises_stress").string_value(), "Pa");
  const auto& segment = fields.at("segments").list_value().values(0).struct_value().fields();
  const auto& stations = segment.at("stations").struct_value().fields();
  EXPECT_EQ(stations.at("von_mises_stress").list_value().values_size(), 6);
  EXPECT_EQ(stations.at("position").list_value().values_size(), 6);
}

TEST_F(LinkageExport, ScenesComeBackAsEdited) {
  const auto files = fetch(proto::EXPORT_FORMAT_SCENE);
  proto::Scene scene = scene_from_json(files.at("film.json"));
  EXPECT_NEAR(scene.linkage().conditions().mean_angle_degrees(), 40, 1e-9);
  EXPECT_EQ(scene.linkage().lines().path(), "film.obj");
  scene.mutable_linkage()->mutable_lines()->mutable_file()->set_name("film.obj");
  scene.mutable_linkage()->mutable_lines()->mutable_file()->set_content(files.at("film.obj"));
  ASSERT_TRUE(client.call(open_request(scene, "again")).has_open_session());
  const auto first = client.call(wait_request("s", 1)).wait().result();
  const auto again = client.call(wait_request("again", 0)).wait().result();
  EXPECT_NEAR(again.linkage().mean_angle_degrees(), 40, 1e-6);
  EXPECT_NEAR(again.total_energy(), first.total_energy(), 1e-4 * first.total_energy() + 1e-9);
}

TEST_F(LinkageExport, FormatsAndPartsThatAreNotThere) {
  proto::Request request;
  request.mutable_export_()->set_session("s");
  const auto refused = [&](proto::ExportFormat format) {
    request.mutable_export_()->set_format(format);
    return client.call(request).error();
  };
  EXPECT_EQ(refused(proto::EXPORT_FORMAT_UNSPECIFIED).field(), "format");
  EXPECT_EQ(refused(proto::EXPORT_FORMAT_PVD).field(), "format");
  EXPECT_NE(refused(proto::EXPORT_FORMAT_PC2).message().find("VTP"), std::string::npos);
  request.mutable_export_()->set_part(7);
  for (const auto format : {proto::EXPORT_FORMAT_VTP, proto::EXPORT_FORMAT_OBJ,
                            proto::EXPORT_FORMAT_JSON, proto::EXPORT_FORMAT_SCENE}) {
    request.mutable_export_()->set_part(0);
    request.mutable_export_()->set_format(format);
    EXPECT_TRUE(client.call(request).has_export_()) << format;
    request.mutable_export_()->set_part(7);
    EXPECT_EQ(refused(format).field(), "part") << format;
  }
  open_and_solve(client, "body");
  request.mutable_export_()->set_session("body");
  request.mutable_export_()->set_part(0);
  EXPECT_EQ(refused(proto::EXPORT_FORMAT_VTP).field(), "format");
  EXPECT_NE(refused(proto::EXPORT_FORMAT_JSON).message().find("PVD"), std::string::npos);
}

}  // namespace
}  // namespace limber::server
