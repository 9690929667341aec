// Frames, scene files and exported files, without a server.

#include <gtest/gtest.h>

#include <cstring>

#include "clients/cpp/bodies/scene_files.h"
#include "clients/cpp/bodies/surface_files.h"
#include "clients/cpp/error.h"
#include "clients/cpp/frames.h"
#include "clients/cpp/plain_files.h"
#include "clients/cpp/scene_files.h"
#include "tests/clients/refusal.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {
namespace {

template <class Number>
v1::Array array(v1::DataType type, const std::vector<std::uint64_t>& shape,
                const std::vector<Number>& values) {
  v1::Array message;
  message.set_type(type);
  for (const auto extent : shape) message.add_shape(extent);
  message.mutable_data()->assign(reinterpret_cast<const char*>(values.data()),
                                 values.size() * sizeof(Number));
  return message;
}

v1::GetGeometryResponse geometry() {
  v1::GetGeometryResponse message;
  *message.mutable_rest() = array<float>(v1::DATA_TYPE_FLOAT32, {2, 3}, {0, 0, 0, 1, 0, 0});
  *message.mutable_basis() =
      array<float>(v1::DATA_TYPE_FLOAT32, {2, 3, 2}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
  message.set_basis_hash("b");
  return message;
}

v1::Frames coordinate_frames() {
  v1::Frames frames;
  frames.set_encoding(v1::ENCODING_COORDINATES);
  *frames.mutable_data() = array<float>(v1::DATA_TYPE_FLOAT32, {2, 2}, {1, 0, 0.5, -1});
  frames.set_basis_hash("b");
  return frames;
}

TEST(Frames, CoordinatesAreRestPlusBasisTimesCoordinates) {
  const auto geo = geometry();
  const auto positions = decode(coordinate_frames(), &geo);
  EXPECT_EQ(positions.frames, 2U);
  EXPECT_EQ(positions.nodes, 2U);
  EXPECT_EQ(positions.values,
            (std::vector<double>{1, 3, 5, 8, 9, 11, -1.5, -2.5, -3.5, -3.5, -5.5, -6.5}));
}

TEST(Frames, NoneAreNone) {
  v1::Frames frames;
  frames.set_encoding(v1::ENCODING_POSITIONS_QUANTISED);
  *frames.mutable_data() = array<std::uint16_t>(v1::DATA_TYPE_UINT16, {0, 5, 3}, {});
  const auto positions = decode(frames, nullptr);
  EXPECT_EQ(positions.frames, 0U);
  EXPECT_EQ(positions.nodes, 5U);
  EXPECT_TRUE(positions.values.empty());
  *frames.mutable_data() = array<std::uint16_t>(v1::DATA_TYPE_UINT16, {5, 0, 3}, {});
  EXPECT_EQ(refusal([&] { (void)decode(frames, nullptr); }).code(), v1::ERROR_CODE_MALFORMED);
}

TEST(Frames, ShapesThatLieAreRefused) {
  auto geo = geometry();
  auto frames = coordinate_frames();
  frames.mutable_data()->set_shape(0, std::uint64_t{1} << 62);
  EXPECT_EQ(refusal([&] { (void)decode(frames, &geo); }).code(), v1::ERROR_CODE_MALFORMED);
  frames = coordinate_frames();
  frames.mutable_data()->mutable_data()->pop_back();
  EXPECT_EQ(refusal([&] { (void)decode(frames, &geo); }).code(), v1::ERROR_CODE_MALFORMED);
  frames = coordinate_frames();
  *frames.mutable_data() = array<float>(v1::DATA_TYPE_FLOAT32, {1, 3}, {1, 2, 3});
  EXPECT_EQ(refusal([&] { (void)decode(frames, &geo); }).code(), v1::ERROR_CODE_MALFORMED);
  geo.set_basis_hash("other");
  EXPECT_EQ(refusal([&] { (void)decode(coordinate_frames(), &geo); }).code(),
            v1::ERROR_CODE_FAILED_PRECONDITION);
}

TEST(Frames, QuantisedPositionsLieInTheirBox) {
  v1::Frames frames;
  frames.set_encoding(v1::ENCODING_POSITIONS_QUANTISED);
  *frames.mutable_data() = array<std::uint16_t>(v1::DATA_TYPE_UINT16, {1, 1, 3}, {0, 65535, 13107});
  frames.mutable_origin()->set_x(-1);
  frames.mutable_extent()->set_x(2);
  frames.mutable_origin()->set_y(-1);
  frames.mutable_extent()->set_y(3);
  frames.mutable_extent()->set_z(1);
  EXPECT_EQ(decode(frames, nullptr).values, (std::vector<double>{-1, 2, 0.2F}));
}

TEST(Frames, NpyHeaderIsAligned) {
  const std::string file = npy({2, 1, {1, 2, 3, 4, 5, 6}});
  ASSERT_EQ(file.substr(0, 6), "\x93NUMPY");
  const std::size_t header =
      static_cast<unsigned char>(file[8]) + 256 * static_cast<unsigned char>(file[9]);
  EXPECT_EQ((10 + header) % 64, 0U);
  EXPECT_EQ(file.size(), 10 + header + 24);
  EXPECT_NE(file.find("'shape': (2, 1, 3)"), std::string::npos);
  EXPECT_EQ(file[10 + header - 1], '\n');
}

TEST(SceneFiles, TheMeshAndItsCompanionsAreUploaded) {
  const limber::TemporaryFolder folder;
  write_bytes(folder.path() / "body.ele", "elements");
  write_bytes(folder.path() / "body.node", "nodes");
  write_bytes(folder.path() / "body.elastic", "materials");
  write_bytes(folder.path() / "scene.json",
              R"({"name": "n", "frames": 7, "mesh": {"path": "body.ele"}})");
  const auto scene = load_scene(folder.path() / "scene.json");
  EXPECT_EQ(scene.frames(), 7U);
  EXPECT_EQ(scene.mesh().file().name(), "body.ele");
  EXPECT_EQ(scene.mesh().file().content(), "elements");
  ASSERT_EQ(scene.mesh().file().companions_size(), 2);
  EXPECT_EQ(scene.mesh().file().companions().at("body.node"), "nodes");
  EXPECT_EQ(scene.mesh().file().companions().at("body.elastic"), "materials");
}

TEST(SceneFiles, VegaIncludesAreFound) {
  const limber::TemporaryFolder folder;
  write_bytes(folder.path() / "a.veg", "*VERTICES\n*INCLUDE a.node \r\n*include a.ele\n");
  write_bytes(folder.path() / "a.node", "n");
  write_bytes(folder.path() / "a.ele", "e");
  EXPECT_EQ(mesh_file(folder.path() / "a.veg").companions_size(), 2);
}

TEST(SceneFiles, BaseMotionsAreUploaded) {
  const limber::TemporaryFolder folder;
  write_bytes(folder.path() / "m.pc2", "cache");
  write_bytes(folder.path() / "f" / "a&b.vtu", "first");
  write_bytes(folder.path() / "f" / "c.vtu", "second");
  const std::string pvd =
      "<VTKFile><DataSet timestep=\"1\" part='0' file=\"a&amp;b.vtu\"/>\n"
      "<DataSet file='c.vtu' timestep=\"0\"/><DataSet file='c.vtu'/></VTKFile>";
  write_bytes(folder.path() / "f" / "m.pvd", pvd);
  const auto loaded = [&](const std::string& motion) {
    write_bytes(folder.path() / "s.json", R"({"base_motion": )" + motion + "}");
    return load_scene(folder.path() / "s.json").base_motion();
  };
  EXPECT_EQ(loaded(R"({"path": "m.pc2"})").pc2(), "cache");
  const auto listed = loaded(R"({"path": "f/m.pvd"})").vtu_series();
  EXPECT_EQ(listed.pvd(), pvd);
  ASSERT_EQ(listed.files_size(), 2);  // each once, by the name that the list gives it
  EXPECT_EQ(listed.files(0).name(), "a&b.vtu");
  EXPECT_EQ(listed.files(0).content(), "first");
  EXPECT_EQ(listed.files(1).content(), "second");
  const auto named = loaded(R"({"vtu_series": {"paths": ["f/c.vtu", "f/a&b.vtu"]}})").vtu_series();
  ASSERT_EQ(named.files_size(), 2);
  EXPECT_EQ(named.files(1).content(), "first");
  EXPECT_EQ(named.paths_size(), 0);
  const auto refused = [&](const std::string& motion) {
    return refusal([&] { (void)loaded(motion); });
  };
  EXPECT_EQ(refused(R"({"path": "m.vtu"})").field(), "base_motion.path");
  EXPECT_EQ(refused(R"({"path": "none.pc2"})").code(), v1::ERROR_CODE_IO);
  EXPECT_EQ(refused(R"({"vtu_series": {"paths": ["f/c.vtu", "x"]}})").field(),
            "base_motion.vtu_series.paths[1]");
}

// A regular expression over it ended the client on its stack.
TEST(SceneFiles, ATagOfAMillionCharactersIsRead) {
  const limber::TemporaryFolder folder;
  write_bytes(folder.path() / "c.vtu", "second");
  write_bytes(folder.path() / "m.pvd", "<VTKFile><DataSet group=\"" + std::string(1'000'000, 'x') +
                                           "\" file=\"c.vtu\"/><DataSet");
  write_bytes(folder.path() / "s.json", R"({"base_motion": {"path": "m.pvd"}})");
  EXPECT_EQ(load_scene(folder.path() / "s.json").base_motion().vtu_series().files_size(), 1);
}

TEST(SceneFiles, PaintedStiffnessIsUploaded) {
  const limber::TemporaryFolder folder;
  write_bytes(folder.path() / "f" / "a.txt", "1 2 3");
  write_bytes(folder.path() / "s.json",
              R"({"painted_stiffness": {"path": "f/a.txt", "points": "PAINTED_POINTS_NODES"}})");
  const auto painted = load_scene(folder.path() / "s.json").painted_stiffness();
  EXPECT_EQ(painted.file().name(), "a.txt");
  EXPECT_EQ(painted.file().content(), "1 2 3");
  EXPECT_EQ(painted.points(), v1::PAINTED_POINTS_NODES);
  EXPECT_EQ(refusal([&] { (void)painted_stiffness(folder.path() / "none.txt"); }).field(),
            "painted_stiffness.path");
  write_bytes(folder.path() / "s.json", R"({"name": "a"})");
  EXPECT_FALSE(load_scene(folder.path() / "s.json").has_painted_stiffness());
}

TEST(SceneFiles, SurfacesAreToldByTheirEndings) {
  const limber::TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.stl", "a.OFF", "a.glb"}) {
    write_bytes(folder.path() / name, "x");
    EXPECT_EQ(kind_of_file(folder.path() / name), FileKind::kTriangles) << name;
  }
  write_bytes(folder.path() / "m.surface.glb", "x");
  EXPECT_TRUE(surface_beside(folder.path() / "m.msh") == folder.path() / "m.surface.glb");
}

TEST(SceneFiles, WhatCannotBeReadIsReported) {
  const limber::TemporaryFolder folder;
  EXPECT_EQ(refusal([&] { (void)load_scene(folder.path() / "none.json"); }).code(),
            v1::ERROR_CODE_IO);
  EXPECT_EQ(refusal([&] { (void)load_scene(folder.path()); }).code(), v1::ERROR_CODE_IO);
  write_bytes(folder.path() / "s.json", R"({"framez": 3})");
  EXPECT_EQ(refusal([&] { (void)load_scene(folder.path() / "s.json"); }).field(), "scene.framez");
  write_bytes(folder.path() / "s.json", R"({"mesh": {"path": "missing.msh"}})");
  EXPECT_EQ(refusal([&] { (void)load_scene(folder.path() / "s.json"); }).field(), "mesh.path");
}

TEST(SceneFiles, ArraysAreSavedAsMshBesideTheScene) {
  const limber::TemporaryFolder folder;
  v1::Scene scene;
  scene.set_frames(9);
  *scene.mutable_mesh()->mutable_arrays()->mutable_nodes() =
      array<double>(v1::DATA_TYPE_FLOAT64, {4, 3}, {0, 0, 0, 0.1, 0, 0, 0, 1, 0, 0, 0, 1});
  *scene.mutable_mesh()->mutable_arrays()->mutable_tets() =
      array<std::int32_t>(v1::DATA_TYPE_INT32, {1, 4}, {0, 1, 2, 3});
  EXPECT_EQ(save_scene(scene, "tet", folder.path()), folder.path() / "tet.json");
  const std::string mesh = read_bytes(folder.path() / "tet.msh", "");
  EXPECT_NE(mesh.find("2 0.1 0 0\n"), std::string::npos);
  EXPECT_NE(mesh.find("1 4 0 1 2 3 4\n"), std::string::npos);
  EXPECT_EQ(load_scene(folder.path() / "tet.json").mesh().file().content(), mesh);
}

TEST(ExportedFiles, StayBelowTheFolder) {
  const limber::TemporaryFolder folder;
  v1::ExportedFile file;
  file.set_name("a/b.vtu");
  file.set_content("1");
  write_exported(folder.path(), file);
  file.set_append(true);
  write_exported(folder.path(), file);
  EXPECT_EQ(read_bytes(folder.path() / "a/b.vtu", ""), "11");
  for (const char* name : {"../x", "/etc/x", "", "a/../../x", "a/"}) {
    file.set_name(name);
    EXPECT_EQ(refusal([&] { write_exported(folder.path(), file); }).code(),
              v1::ERROR_CODE_MALFORMED)
        << name;
  }
}

}  // namespace
}  // namespace limber::client
