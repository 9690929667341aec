#include "engine/scene/formats/surface_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "engine/base/error.h"
#include "engine/bodies/boundary_surface.h"
#include "engine/scene/samples/samples.h"
#include "tests/engine/scene/shared_data.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TriangleSurface dino_surface() {
  const Scene dino = make_sample("dino");
  TriangleSurface surface;
  surface.vertices = dino.mesh.nodes;
  surface.triangles = bodies::boundary_surface(dino.mesh.tets);
  return surface;
}

std::string binary_stl(const TriangleSurface& surface) {
  std::string bytes(80, ' ');
  bytes.replace(0, 5, "solid");  // some writers do
  const auto put = [&](auto value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
  };
  put(static_cast<std::uint32_t>(surface.triangle_count()));
  for (int t = 0; t < surface.triangle_count(); ++t) {
    for (int i = 0; i < 3; ++i) put(0.0f);
    for (int c = 0; c < 3; ++c) {
      for (int axis = 0; axis < 3; ++axis)
        put(static_cast<float>(surface.vertices(axis, surface.triangles(c, t))));
    }
    put(std::uint16_t{0});
  }
  return bytes;
}

std::string binary_ply(const TriangleSurface& surface, bool big_endian) {
  std::string bytes = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") +
                      "_endian 1.0\nelement vertex " + std::to_string(surface.vertex_count()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar "
                      "tag\nelement face " +
                      std::to_string(surface.triangle_count()) +
                      "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (big_endian) std::reverse(raw, raw + sizeof value);
    bytes.append(raw, sizeof value);
  };
  for (int i = 0; i < surface.vertex_count(); ++i) {
    for (int axis = 0; axis < 3; ++axis) put(surface.vertices(axis, i));
    put(std::uint8_t{255});
  }
  for (int t = 0; t < surface.triangle_count(); ++t) {
    put(std::uint8_t{3});
    for (int c = 0; c < 3; ++c) put(surface.triangles(c, t));
  }
  return bytes;
}

TEST(SurfaceFormats, ObjComesBackToTheLastBitWithAllNodes) {
  const TriangleSurface surface = dino_surface();
  const TriangleSurface back =
      read_surface("a.obj", write_obj(surface.vertices, surface.triangles));
  EXPECT_EQ(back.vertices, surface.vertices);
  EXPECT_EQ(back.triangles, surface.triangles);
}

TEST(SurfaceFormats, BinaryPlyIsReadInBothByteOrders) {
  const TriangleSurface surface = dino_surface();
  for (const bool big_endian : {false, true}) {
    const TriangleSurface back = read_surface("a.ply", binary_ply(surface, big_endian));
    EXPECT_EQ(back.vertices, surface.vertices);
    EXPECT_EQ(back.triangles, surface.triangles);
  }
}

TEST(SurfaceFormats, BinaryStlIsReadAndItsVerticesMerged) {
  const TriangleSurface surface = dino_surface();
  const TriangleSurface back = read_surface("a.stl", binary_stl(surface));
  EXPECT_EQ(back.triangle_count(), surface.triangle_count());
  // Only nodes on the surface are in the file; on a closed surface of genus 0, V = T / 2 + 2.
  EXPECT_EQ(back.vertex_count(), surface.triangle_count() / 2 + 2);
  const SurfaceCheck check = check_surface(back);
  EXPECT_TRUE(check.closed_manifold());
  EXPECT_TRUE(check.oriented());
  EXPECT_NEAR(check.volume, check_surface(surface).volume, 1e-7);
}

TEST(SurfaceFormats, PolygonsAndRelativeIndicesOfObjAreUnderstood) {
  const TriangleSurface cube = read_surface(
      "a.obj",
      "# cube\nmtllib x\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1 0.5 0.5 "
      "0.5\nv 0 1 1\nvn 0 0 1\n"
      "f 4 3 2 1\nf 5/1/1 6/1/1 7//1 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf -5 -8 -4 -1\n");
  EXPECT_EQ(cube.triangle_count(), 12);
  ASSERT_EQ(cube.warnings.size(), 1);
  const SurfaceCheck check = check_surface(cube);
  EXPECT_TRUE(check.closed_manifold());
  EXPECT_TRUE(check.oriented());
  EXPECT_NEAR(check.volume, 1, 1e-15);
}

TEST(SurfaceFormats, AByteOrderMarkIsSkipped) {
  const std::string mark = "\xEF\xBB\xBF";
  const std::string obj = mark + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(read_surface("a.obj", obj).vertices.cols(), 3);
  const std::string ply =
      mark +
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_EQ(read_surface("a.ply", ply).vertices.cols(), 3);
  const std::string stl =
      mark +
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid a\n";
  EXPECT_EQ(read_surface("a.stl", stl).vertices.cols(), 3);
}

TEST(SurfaceFormats, FaultsAreNamedWithTheirLine) {
  const auto reading = [](const char* name, const std::string& text) {
    return message_of([&] { static_cast<void>(read_surface(name, text)); });
  };
  EXPECT_THAT(reading("a.obj", "v 0 0 0\nv 1 0 x\n"),
              HasSubstr("a.obj:2: expected coordinate z, found 'x'"));
  EXPECT_THAT(reading("a.obj", "v 0 0 0\nf 1 2 3\n"),
              HasSubstr("a.obj:2: a face uses vertex 1 (from 0) of 1"));
  EXPECT_THAT(reading("a.obj", "v 0 0 0\nf 1 0 1\n"),
              HasSubstr("a.obj:2: vertex index 0: OBJ files count vertices from 1"));
  EXPECT_THAT(reading("a.obj", "v 0 0 0\nf 1 1\n"), HasSubstr("fewer than three"));
  EXPECT_THAT(reading("a.obj", "v 0 0 0\n"), HasSubstr("no triangles"));
  EXPECT_THAT(reading("a.stl", "hello"), HasSubstr("neither a text STL file"));
  EXPECT_THAT(reading("a.stl", "solid x\nfacet\nouter loop\nvertex 0 0 0\n"),
              HasSubstr("inside a facet"));
  EXPECT_THAT(
      reading("a.ply",
              "ply\nformat ascii 1.0\nelement vertex 999999999\nproperty float x\nend_header\n"),
      HasSubstr("more than the rest"));
  EXPECT_THAT(reading("a.foo", "x"), HasSubstr("not recognised"));
}

std::string cube_off(const std::string& head, const std::string& of_vertex) {
  std::string text = head;
  for (const char* at : {"0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"})
    text += at + of_vertex + "\n";
  return text +
         "4 3 2 1 0\n4 4 5 6 7  255 0 0  # red\n4 0 1 5 4\n\n4 1 2 6 5 0.5 0.5 0.5 1\n"
         "4 2 3 7 6\n4 3 0 4 7\n";
}

TEST(SurfaceFormats, OffIsReadWithColoursNormalsCommentsAndCounts) {
  for (const std::string& text :
       {cube_off("OFF\n8 6 12\n", ""), cube_off("OFF 8 6 12\n", ""), cube_off("8 6 0\n", ""),
        cube_off("# made by hand\nOFF # here\n# counts\n8 6\n\n", " # a vertex"),
        cube_off("COFF\n8 6 12\n", " 255 128 0 255"), cube_off("NOFF\n8 6 12\n", " 0 0 1"),
        cube_off("CNOFF\r\n8 6 12\r\n", " 0 0 1 0.1 0.2 0.3 1"),
        cube_off("STCNOFF\n8 6 12\n", " 0 0 1 0.1 0.2 0.3 1 0 0")}) {
    const TriangleSurface cube = read_surface("a.OFF", text);
    EXPECT_EQ(cube.vertex_count(), 8);
    EXPECT_EQ(cube.triangle_count(), 12);
    EXPECT_THAT(cube.warnings, ::testing::ElementsAre("6 polygons are cut into triangles"));
    const SurfaceCheck check = check_surface(cube);
    EXPECT_TRUE(check.closed_manifold());
    EXPECT_TRUE(check.oriented());
    EXPECT_NEAR(check.volume, 1, 1e-15);
  }
}

TEST(SurfaceFormats, FaultsOfOffAreNamedWithTheirLine) {
  const auto reading = [](const std::string& text) {
    return message_of([&] { static_cast<void>(read_surface("a.off", text)); });
  };
  EXPECT_THAT(reading(""), HasSubstr("a.off:1: the file is empty"));
  EXPECT_THAT(reading("solid\n"), HasSubstr("a.off:1: expected the keyword OFF, found 'solid'"));
  EXPECT_THAT(reading("4OFF\n1 1 1\n"), HasSubstr("no three coordinates"));
  EXPECT_THAT(reading("OFF BINARY\n"), HasSubstr("binary .off files are not read"));
  EXPECT_THAT(reading("OFF\n999999999 1 0\n0 0 0\n"), HasSubstr("more than the rest"));
  EXPECT_THAT(reading("OFF\n1 1 0\n0 0\n3 0 0 0\n"), HasSubstr("a.off:3: expected coordinate z"));
  EXPECT_THAT(reading("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n"),
              HasSubstr("a.off:6: expected a vertex index"));
  EXPECT_THAT(reading("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 4294967296\n"),
              HasSubstr("a.off:6: a face uses vertex 4294967296 (from 0) of 3"));
  const TriangleSurface slim =
      read_surface("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n");
  EXPECT_THAT(slim.warnings, ::testing::ElementsAre(HasSubstr("1 faces of fewer than three")));
}

TEST(Surfaces, ThatEncloseNothingAreRefusedWithTheEdge) {
  const TriangleSurface good = dino_surface();
  const auto refusal = [](const TriangleSurface& surface) {
    return message_of([&] { static_cast<void>(closed_outward(surface)); });
  };
  EXPECT_EQ(refusal(good), "");
  TriangleSurface open = good;
  open.triangles.conservativeResize(3, good.triangle_count() - 1);
  EXPECT_THAT(refusal(open), HasSubstr("3 edges belong to one triangle only"));
  TriangleSurface crowded = good;
  crowded.triangles.conservativeResize(3, good.triangle_count() + 1);
  crowded.triangles.rightCols(1) = good.triangles.leftCols(1);
  EXPECT_THAT(refusal(crowded), HasSubstr("3 edges belong to three or more triangles"));
  TriangleSurface flipped = good;
  std::swap(flipped.triangles(0, 0), flipped.triangles(1, 0));
  EXPECT_THAT(refusal(flipped), HasSubstr("oriented against each other at 3 edges"));
  TriangleSurface nan = good;
  nan.vertices(0, good.triangles(0, 0)) = std::nan("");
  EXPECT_THAT(refusal(nan), HasSubstr("not finite"));
  TriangleSurface range = good;
  range.triangles(0, 0) = -1;
  EXPECT_THAT(refusal(range), HasSubstr("does not exist"));
}

TEST(Surfaces, ThatAreInsideOutAreTurnedOver) {
  TriangleSurface inward = dino_surface();
  const double volume = check_surface(inward).volume;
  EXPECT_GT(volume, 0.01);
  inward.triangles.row(0).swap(inward.triangles.row(1));
  const TriangleSurface outward = closed_outward(inward);
  EXPECT_NEAR(check_surface(outward).volume, volume, 1e-15);
  ASSERT_EQ(outward.warnings.size(), 1);
}

TEST(SurfaceFormats, TheTyrannosaurusIsClosed) {
  const std::filesystem::path path = testing::shared_body("tyrannosaurus/mesh.obj");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const TriangleSurface surface = read_surface_file(path);
  EXPECT_EQ(surface.vertex_count(), 4400);
  EXPECT_TRUE(check_surface(surface).closed_manifold());
  EXPECT_TRUE(check_surface(surface).oriented());
}

}  // namespace
}  // namespace limber::scene
