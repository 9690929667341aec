#include "engine/scene/formats/line_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;

std::string message_of(const std::string& name, const std::string& text) {
  try {
    (void)read_line_mesh(name, text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LineFormats, ReadsVerticesAndLines) {
  const rods::LineMesh mesh = read_line_mesh("a.OBJ",
                                             "# rods\nmtllib x.mtl\nv 0 0 0\nv 1 0 0.5 1\no "
                                             "part\nl 1 2\nv 2 -1e-1 0\nl 1/7 -1/3 2\nf 1 2 3\n");
  ASSERT_EQ(mesh.vertex_count(), 3);
  EXPECT_EQ(mesh.vertices.col(2), Eigen::Vector3d(2, -0.1, 0));
  Eigen::Matrix<int, 2, 3> edges;
  edges << 0, 0, 2, 1, 2, 1;  // a line of three vertices is two edges
  EXPECT_EQ(mesh.edges, edges);
}

TEST(LineFormats, BadFilesNameTheLine) {
  EXPECT_THAT(message_of("a.obj", "v 0 0 0\nv 1 0 0\nl 1 3\n"),
              HasSubstr("a.obj:3: a line uses vertex 2"));
  EXPECT_THAT(message_of("a.obj", "v 0 0 0\nl 1\n"),
              HasSubstr("a.obj:2: a line of fewer than two"));
  EXPECT_THAT(message_of("a.obj", "v 0 0\nl 1 1\n"), HasSubstr("a.obj:1:"));
  EXPECT_THAT(message_of("a.obj", "v 0 0 0\nl 1 0\n"),
              HasSubstr("a.obj:2: vertex index 0: OBJ files count vertices from 1"));
  EXPECT_THAT(message_of("a.obj", "v 0 0 0\nf 1 1 1\n"), HasSubstr("no lines"));
  EXPECT_THAT(message_of("a.ply", "ply\n"), HasSubstr(".obj"));
  const std::string points = "v 0 0 0\nv 1 0 0\n# twice\nv 1 0 0\n";
  EXPECT_THAT(message_of("a.obj", points + "l 1 2\n\nl 2 1\n"),
              HasSubstr("a.obj:7: edge 1 joins vertices 1 and 0 as edge 0 does (from 0)"));
  EXPECT_THAT(message_of("a.obj", points + "l 1 2 3\n"),
              HasSubstr("a.obj:5: edge 1 has no length: vertices 1 and 2 coincide (from 0)"));
  EXPECT_THAT(message_of("a.obj", points + "l 1 1\n"), HasSubstr("a.obj:5: edge 0 joins vertex 0"));
}

}  // namespace
}  // namespace limber::scene
