// Remarks on lines that touch where nothing joins them, and of sections in another unit.

#include "engine/session/linkages/remarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/base/random.h"
#include "engine/session/linkages/mapping.h"

namespace limber::session {
namespace {

/// Lines along x across lines along y, in metres.
scene::Linkage lattice(int rows, int columns) {
  scene::Linkage linkage;
  linkage.lines.vertices.resize(3, Eigen::Index{2} * (rows + columns));
  linkage.lines.edges.resize(2, Eigen::Index{rows} + columns);
  for (int k = 0; k < rows + columns; ++k) {
    const bool across = k < rows;
    const double at = across ? k : k - rows, end = across ? columns : rows;
    const Eigen::Vector3d along = across ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    const Eigen::Vector3d start =
        at * (across ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX()) - along;
    linkage.lines.vertices.col(2 * k) = start;
    linkage.lines.vertices.col(2 * k + 1) = start + (end + 1) * along;
    linkage.lines.edges.col(k) << 2 * k, 2 * k + 1;
  }
  return linkage;
}

TEST(LinkageRemarks, PlacesThatAreNotListedAreCountedAsFarAsTheyWereFound) {
  EXPECT_EQ(linkage_remarks(lattice(2, 5)).size(), 10U);
  EXPECT_EQ(linkage_remarks(lattice(3, 5)).back().message,
            "edges touch where nothing joins them in 5 more places");
  EXPECT_EQ(linkage_remarks(lattice(25, 40)).back().message,
            "edges touch where nothing joins them in 990 more places");
  EXPECT_EQ(linkage_remarks(lattice(25, 41)).back().message,
            "edges touch where nothing joins them in at least 990 more places");
}

TEST(LinkageRemarks, SectionsInAnotherUnitThanTheLinesAreReported) {
  scene::Linkage linkage = lattice(1, 1);
  linkage.length_unit_in_metres = 1e-3;
  linkage.section = rods::Rectangle{0.2, 0.05};
  EXPECT_EQ(linkage_remarks(linkage).size(), 1U);  // that they cross
  linkage.section = rods::Rectangle{0.2e-3, 0.05e-3};
  ASSERT_EQ(linkage_remarks(linkage).size(), 2U);
  EXPECT_EQ(linkage_remarks(linkage).front().field, "section");
  EXPECT_EQ(linkage_remarks(linkage).front().message,
            "the linkage is 2.83 mm across and its rods 5e-05 mm thick, more than 20000 to 1: is "
            "the section in the unit of the lines?");
  linkage.section = rods::Rectangle{200, 50};
  EXPECT_THAT(
      linkage_remarks(linkage).front().message,
      ::testing::HasSubstr("the section is 200 mm wide, and half of the lines are shorter"));
}

/// Hexagons whose vertices are moved at random: at each joint of three lines the straightest pair
/// is another, and those of all joints do not fit together.
scene::Linkage honeycomb(int size) {
  Random random(8);
  scene::Linkage linkage;
  const auto vertex = [&](int i, int j) { return i * 2 * size + j; };
  linkage.lines.vertices.resize(3, Eigen::Index{2} * size * size);
  std::vector<Eigen::Vector2i> edges;
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < 2 * size; ++j) {  // zigzags, joined by every other vertex
      const double up = (i + j) % 2 == 0 ? 0.25 : -0.25;
      linkage.lines.vertices.col(vertex(i, j)) << std::sqrt(0.75) * j + random.uniform(-0.2, 0.2),
          1.5 * i + up + random.uniform(-0.2, 0.2), 0;
      if (j > 0) edges.emplace_back(vertex(i, j - 1), vertex(i, j));
      if (i > 0 && (i + j) % 2 == 1) edges.emplace_back(vertex(i - 1, j), vertex(i, j));
    }
  }
  linkage.lines.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    linkage.lines.edges.col(static_cast<Eigen::Index>(e)) = edges[e];
  return linkage;
}

TEST(LinkageRemarks, PairsOfSegmentsWhoseBendIsNotProvenToBeTheLeastAreReported) {
  for (const int size : {3, 30}) {
    const scene::Linkage linkage = honeycomb(size);
    const auto check = check_linkage(linkage);
    ASSERT_TRUE(check.issues.empty()) << check.issues.front().message;
    const auto issues = linkage_remarks(linkage);
    if (size == 3) {
      EXPECT_TRUE(issues.empty()) << "small meshes are solved exactly";
      continue;
    }
    ASSERT_EQ(issues.size(), 1U);
    EXPECT_EQ(issues[0].field, "lines");
    EXPECT_THAT(issues[0].message, ::testing::HasSubstr("may bend the rods more than necessary"));
  }
}

/// A roof of 12 m in millimetres whose unit is not given, so that it is taken for metres.
TEST(LinkageRemarks, ARoofOfTwelveKilometresIsReported) {
  scene::Linkage linkage = lattice(1, 1);
  linkage.lines.vertices *= 6000;
  linkage.section = rods::Rectangle{120, 24};
  const auto large = [&] {
    const auto issues = linkage_remarks(linkage);
    return issues.front().field == "length_unit_in_metres" ? issues.front().message : "";
  };
  EXPECT_EQ(
      large(),
      "the linkage is 12 km x 12 km x 0 km large, with 1 m in a length unit: if its lines are "
      "in millimetres, set length_unit_in_metres to 0.001");
  linkage.length_unit_in_metres = 1e-3;
  EXPECT_EQ(large(), "");
}

}  // namespace
}  // namespace limber::session
