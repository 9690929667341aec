// Binary glTF 2.0 as read_surface() reads it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "engine/base/error.h"
#include "engine/scene/formats/surface_formats.h"
#include "tests/engine/scene/glb_files.h"

namespace limber::scene {
namespace {

using testing::bytes_of;
using ::testing::ElementsAre;
using testing::glb_of;
using testing::GlbJson;
using ::testing::HasSubstr;
using testing::kTetrahedronFaces;
using testing::kTetrahedronPoints;
using testing::tetrahedron_glb;

TriangleSurface read(const std::string& content) { return read_surface("a.glb", content); }

Error refusal(const std::string& content) {
  try {
    static_cast<void>(read(content));
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "a.glb");
    return error;
  }
  return Error(ErrorCode::kInternal, "", "nothing was refused");
}

std::string why(const std::string& content) { return refusal(content).what(); }

void expect_tetrahedron(const TriangleSurface& surface, double volume = 1.0 / 6) {
  const SurfaceCheck check = check_surface(surface);
  EXPECT_TRUE(check.closed_manifold());
  EXPECT_TRUE(check.oriented());
  EXPECT_NEAR(check.volume, volume, 1e-6);
}

/// Sum of the vectors of area of all triangles.
Eigen::Vector3d area(const TriangleSurface& surface) {
  Eigen::Vector3d sum(0, 0, 0);
  for (int t = 0; t < surface.triangle_count(); ++t) {
    const auto at = [&](int corner) { return surface.vertices.col(surface.triangles(corner, t)); };
    sum += (at(1) - at(0)).cross(at(2) - at(0)) / 2;
  }
  return sum;
}

template <class Index>
std::string tetrahedron_of() {
  std::string faces;
  for (const int corner : kTetrahedronFaces) faces += bytes_of<Index>({static_cast<Index>(corner)});
  GlbJson json;
  json.index_bytes = sizeof(Index);
  return glb_of(json.text(), kTetrahedronPoints + faces);
}

TEST(Glb, IndicesOfEverySizeAreRead) {
  expect_tetrahedron(read(tetrahedron_of<std::uint8_t>()));
  expect_tetrahedron(read(tetrahedron_of<std::uint16_t>()));
  expect_tetrahedron(read(tetrahedron_of<std::uint32_t>()));
  EXPECT_EQ(read(tetrahedron_glb()).vertex_count(), 4);
  EXPECT_TRUE(read(tetrahedron_glb()).warnings.empty());
}

TEST(Glb, CornersWithoutIndicesAreMergedWhereTheyCoincide) {
  std::string points;
  for (const int corner : kTetrahedronFaces)
    points += kTetrahedronPoints.substr(12 * static_cast<std::size_t>(corner), 12);
  GlbJson json;
  json.points = 12;
  json.corners = 0;
  const TriangleSurface surface = read(glb_of(json.text(), points));
  EXPECT_EQ(surface.vertex_count(), 4);
  expect_tetrahedron(surface);
}

TEST(Glb, NodesPlaceTheirMeshesAsTheyAreNested) {
  GlbJson json;
  // Scaled by (1, 2, 3), turned by 90 degrees about z, moved by (10, 0, 0); below it all by (0, 0,
  // 1).
  json.nodes =
      R"({"children":[1],"translation":[10,0,0],"rotation":[0,0,0.70710678118654752,0.70710678118654752],"scale":[1,2,3]},)"
      R"({"mesh":0,"translation":[0,0,1]})";
  const TriangleSurface placed = read(tetrahedron_glb(json));
  expect_tetrahedron(placed, 1);
  const Eigen::Vector3d low = placed.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = placed.vertices.rowwise().maxCoeff();
  EXPECT_LT((low - Eigen::Vector3d(8, 0, 3)).norm(), 1e-12);
  EXPECT_LT((high - Eigen::Vector3d(10, 1, 6)).norm(), 1e-12);

  json.nodes =
      R"({"children":[1],"matrix":[0,1,0,0,-2,0,0,0,0,0,3,0,10,0,0,1]},{"mesh":0,"translation":[0,0,1]})";
  const TriangleSurface by_matrix = read(tetrahedron_glb(json));
  EXPECT_LT((by_matrix.vertices - placed.vertices).norm(), 1e-12);
}

TEST(Glb, MirroredNodesKeepTheOutsideOutside) {
  GlbJson json;
  json.nodes = R"({"mesh":0,"scale":[-1,1,1]})";
  expect_tetrahedron(read(tetrahedron_glb(json)));
}

TEST(Glb, EveryNodeOfTheDefaultSceneBringsItsMesh) {
  GlbJson json;
  json.nodes =
      R"({"children":[1,2]},{"mesh":0},{"mesh":0,"translation":[0,0,5]},{"mesh":0,"scale":[9,9,9]})";
  const TriangleSurface surface = read(tetrahedron_glb(json));
  EXPECT_EQ(surface.triangle_count(), 8);
  EXPECT_EQ(surface.vertex_count(), 8);
  expect_tetrahedron(surface, 2.0 / 6);
  EXPECT_EQ(surface.vertices.leftCols(4).maxCoeff(), 1);  // in the order of the file
}

TEST(Glb, StripsAndFansFaceOneSide) {
  const std::string square = bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0});
  GlbJson json;
  json.corners = 0;
  json.primitive = R"(,"mode":5)";
  const TriangleSurface strip = read(glb_of(json.text(), square));
  EXPECT_EQ(strip.triangle_count(), 2);
  EXPECT_EQ(area(strip), Eigen::Vector3d(0, 0, 1));
  json.primitive = R"(,"mode":6)";
  const std::string around = bytes_of<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  const TriangleSurface fan = read(glb_of(json.text(), around));
  EXPECT_EQ(fan.triangle_count(), 2);
  EXPECT_EQ(area(fan), Eigen::Vector3d(0, 0, 1));
}

TEST(Glb, StridesAndOffsetsAreFollowed) {
  std::string json =
      R"({"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("accessors":[{"bufferView":0,"byteOffset":4,"componentType":5126,"type":"VEC3","count":3}],)"
      R"("bufferViews":[{"buffer":0,"byteOffset":4,"byteStride":16,"byteLength":48}],"buffers":[{"byteLength":52}]})";
  const std::string points = bytes_of<float>({9, 9, 0, 0, 0, 9, 2, 0, 0, 9, 0, 2, 0});
  EXPECT_EQ(area(read(glb_of(json, points))), Eigen::Vector3d(0, 0, 2));
  // One byte less than the last position needs.
  json.replace(json.find(R"("byteLength":48)"), 15, R"("byteLength":47)");
  EXPECT_THAT(why(glb_of(json, points)), HasSubstr("reaches beyond its buffer view"));
}

TEST(Glb, SparseAccessorsReplacePositions) {
  GlbJson json;
  json.position =
      R"(,"sparse":{"count":1,"indices":{"bufferView":2,"componentType":5121},"values":{"bufferView":3}})";
  std::string text = json.text();
  text.insert(
      text.find(R"(],"buffers")"),
      R"(,{"buffer":0,"byteOffset":60,"byteLength":1},{"buffer":0,"byteOffset":64,"byteLength":12})");
  std::string faces;
  for (const int corner : kTetrahedronFaces) faces += static_cast<char>(corner);
  const std::string data =
      kTetrahedronPoints + faces + std::string("\3\0\0\0", 4) + bytes_of<float>({0, 0, 3});
  expect_tetrahedron(read(glb_of(text, data)), 3.0 / 6);
  // Without a view of their own, positions are 0 where nothing replaces them.
  text.erase(text.find(R"("bufferView":0,)"), 15);
  EXPECT_THAT(why(glb_of(text, data)), HasSubstr("no triangles"));
}

TEST(Glb, QuantisedPositionsAreRead) {
  GlbJson json;
  json.top = R"(,"extensionsRequired":["KHR_mesh_quantization"])";
  json.nodes = R"({"mesh":0,"scale":[2,2,2]})";
  std::string text = json.text();
  const std::string before = R"("componentType":5126,"type":"VEC3")";
  text.replace(text.find(before), before.size(),
               R"("componentType":5122,"normalized":true,"type":"VEC3")");
  std::string points = bytes_of<std::int16_t>({0, 0, 0, 32767, 0, 0, 0, 32767, 0, 0, 0, 32767}) +
                       std::string(24, '\0');
  for (const int corner : kTetrahedronFaces) points += static_cast<char>(corner);
  expect_tetrahedron(read(glb_of(text, points)), 8.0 / 6);
}

TEST(Glb, WhatIsLeftOutIsReported) {
  GlbJson json;
  json.nodes = R"({"mesh":0,"skin":0})";
  json.primitive = R"(,"targets":[{"POSITION":0}]},{"attributes":{"POSITION":0},"mode":1)";
  EXPECT_THAT(
      read(tetrahedron_glb(json)).warnings,
      ElementsAre(HasSubstr("1 primitives of points or lines"), HasSubstr("1 nodes have a skin"),
                  HasSubstr("1 primitives have morph targets")));
  json = {};
  json.corners = 15;
  std::string faces;
  for (const int corner : kTetrahedronFaces) faces += static_cast<char>(corner);
  faces += std::string("\1\1\2", 3);
  const TriangleSurface surface = read(glb_of(json.text(), kTetrahedronPoints + faces));
  expect_tetrahedron(surface);
  EXPECT_THAT(surface.warnings, ElementsAre(HasSubstr("1 triangles with coinciding corners")));
}

TEST(Glb, ExtensionsThatChangeGeometryAreRefusedWithTheReason) {
  for (const char* name : {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}) {
    GlbJson json;
    json.top = std::string(R"(,"extensionsRequired":[")") + name + "\"]";
    const Error error = refusal(tetrahedron_glb(json));
    EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
    EXPECT_THAT(error.what(), HasSubstr(name));
    EXPECT_THAT(error.what(), HasSubstr("export it without compression"));
  }
  GlbJson json;
  json.top = R"(,"extensionsRequired":["KHR_materials_unlit","KHR_texture_transform"])";
  expect_tetrahedron(read(tetrahedron_glb(json)));
}

TEST(Glb, DamageIsRefusedByName) {
  const std::string good = tetrahedron_glb();
  EXPECT_THAT(why("solid"), HasSubstr("does not begin with 'glTF'"));
  std::string version = good;
  version[4] = 1;
  EXPECT_EQ(refusal(version).code(), ErrorCode::kUnsupported);
  EXPECT_THAT(why(good.substr(0, good.size() - 4)), HasSubstr("its header says"));
  const auto with = [](const std::string& nodes, const std::string& primitive = "") {
    GlbJson json;
    json.nodes = nodes;
    json.primitive = primitive;
    return tetrahedron_glb(json);
  };
  EXPECT_THAT(why(with(R"({"mesh":1})")), HasSubstr("mesh 1 (from 0) of 1"));
  EXPECT_THAT(why(with(R"({"mesh":-1})")), HasSubstr("mesh is no number that this file can have"));
  EXPECT_THAT(why(with(R"({"children":[0]})")), HasSubstr("node 0 has two parents"));
  EXPECT_THAT(why(with(R"({"mesh":0,"scale":[1,1]})")), HasSubstr("scale is no list of 3 numbers"));
  EXPECT_THAT(why(with(R"({"mesh":0,"rotation":[0,0,0,0]})")), HasSubstr("length 0"));
  EXPECT_THAT(why(with(R"({"mesh":0,"scale":[1e300,1e300,1e300],"translation":[1e999,0,0]})")),
              HasSubstr("is not JSON"));
  EXPECT_THAT(why(with(R"({"mesh":0)")), HasSubstr("is not JSON"));
  EXPECT_THAT(why(with(std::string(200, '[') + std::string(200, ']'))), HasSubstr("100 levels"));
  GlbJson json;
  json.points = 3;
  EXPECT_THAT(why(tetrahedron_glb(json)), HasSubstr("a vertex that is none of 3"));
  std::string far = good;
  far.replace(far.find("\"count\":12"), 10, "\"count\":13");
  EXPECT_THAT(why(far), HasSubstr("reaches beyond its buffer view"));
}

TEST(Glb, BuffersInOtherFilesAreRefused) {
  std::string text = GlbJson().text();
  text.insert(text.find(R"("buffers":[{)") + 12, R"("uri":"a.bin",)");
  const Error error = refusal(glb_of(text, kTetrahedronPoints));
  EXPECT_EQ(error.code(), ErrorCode::kUnsupported);
  EXPECT_THAT(error.what(), HasSubstr("a buffer is not in this file"));
}

TEST(Glb, RepeatedMeshesAreBounded) {
  // 1000 nodes with a mesh of 2000 triangles, of which all are one.
  std::string nodes = R"({"children":[1)";
  for (int node = 2; node <= 1000; ++node) nodes += "," + std::to_string(node);
  nodes += "]}";
  for (int node = 1; node <= 1000; ++node) nodes += R"(,{"mesh":0})";
  GlbJson json;
  json.nodes = nodes;
  json.corners = 6000;
  std::string faces;
  for (int t = 0; t < 2000; ++t) faces += std::string("\0\1\2", 3);
  EXPECT_EQ(refusal(glb_of(json.text(), kTetrahedronPoints + faces)).code(),
            ErrorCode::kLimitExceeded);
}

}  // namespace
}  // namespace limber::scene
