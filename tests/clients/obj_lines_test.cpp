#include "clients/cpp/obj_lines.h"

#include <gtest/gtest.h>

namespace limber::client {
namespace {

using Lines = std::vector<std::pair<long, long>>;

TEST(ObjLines, PolylinesBecomeTheirLines) {
  const ObjLines obj =
      read_obj_lines("# a comment\nv 0 0 0\nv 1 0.5 -2e1\nv 2 0 0\nv 3 0 0\nl 1 2 3\nl 4 1\n");
  ASSERT_EQ(obj.vertices.size(), 4u);
  EXPECT_EQ(obj.vertices[1], (std::array<double, 3>{1, 0.5, -20}));
  EXPECT_EQ(obj.lines, (Lines{{0, 1}, {1, 2}, {3, 0}}));
  EXPECT_FALSE(obj.has_faces);
}

/// They count back from the vertices that were read so far.
TEST(ObjLines, NegativeNumbersCountBack) {
  const ObjLines obj = read_obj_lines("v 0 0 0\nv 1 0 0\nl -2 -1\nv 2 0 0\nl -1 -3\nl 1 -1\n");
  EXPECT_EQ(obj.lines, (Lines{{0, 1}, {2, 0}, {0, 2}}));
}

TEST(ObjLines, TextureVerticesLineEndsAndOtherWordsDoNotCount) {
  const ObjLines obj = read_obj_lines(
      "vn 0 0 1\r\nvt 0 0\r\n  v 0 0 0 1.0\r\nv 1 0 0\r\nl 1/1 2/2\r\nline 1 2\r\ng l 1 2\r\n");
  ASSERT_EQ(obj.vertices.size(), 2u);
  EXPECT_EQ(obj.vertices[0], (std::array<double, 3>{0, 0, 0}));
  EXPECT_EQ(obj.lines, (Lines{{0, 1}}));
}

TEST(ObjLines, FacesAreNoticedAndNothingIsChecked) {
  const ObjLines obj = read_obj_lines("v 0 0 0\nf 1 2 3\nl 1 9");
  EXPECT_TRUE(obj.has_faces);
  EXPECT_EQ(obj.lines, (Lines{{0, 8}}));
  EXPECT_TRUE(read_obj_lines("l 1\nl\n").lines.empty());
  EXPECT_TRUE(read_obj_lines("").vertices.empty());
}

}  // namespace
}  // namespace limber::client
