// Remarks on lines that touch where nothing joins them, and of sections in another unit.

#include "engine/session/linkages/remarks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

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

std::vector<std::string> remarks_of(const std::vector<Eigen::Vector3d>& vertices,
                                    const std::vector<Eigen::Vector2i>& edges) {
  scene::Linkage linkage;
  linkage.section = rods::Rectangle{0.02, 0.005};
  linkage.lines.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t v = 0; v < vertices.size(); ++v)
    linkage.lines.vertices.col(static_cast<Eigen::Index>(v)) = vertices[v];
  linkage.lines.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    linkage.lines.edges.col(static_cast<Eigen::Index>(e)) = edges[e];
  EXPECT_TRUE(check_linkage(linkage).issues.empty());
  std::vector<std::string> found;
  for (const scene::Issue& issue : linkage_remarks(linkage)) {
    EXPECT_EQ(issue.field, "lines");
    EXPECT_EQ(issue.severity, scene::Issue::Severity::kWarning);
    found.push_back(issue.message);
  }
  return found;
}

/// Three lines that cross pairwise.
TEST(LinkageRemarks, RodsOfMixedAnglesAreReported) {
  const auto remarks =
      remarks_of({{0, 0, 0},
                  {1, 0, 0},
                  {0.5, 0.9, 0},
                  {-0.5, 0, 0},
                  {1.5, 0, 0},
                  {-0.25, -0.45, 0},
                  {0.75, 1.35, 0},
                  {1.25, -0.45, 0},
                  {0.25, 1.35, 0}},
                 {{3, 0}, {0, 1}, {1, 4}, {5, 0}, {0, 2}, {2, 6}, {7, 1}, {1, 2}, {2, 8}});
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0], ::testing::HasSubstr("no mean opening angle can be asked for"));
}

TEST(LinkageRemarks, RodsThatTurnSharplyAreReported) {
  const double half = std::sqrt(0.75);
  const auto remarks =
      remarks_of({{0, 0, 0}, {1, 0, 0}, {half, 0.5, 0}, {0.5, half, 0}}, {{0, 1}, {0, 2}, {0, 3}});
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0], ::testing::HasSubstr(
                              "a rod turns by more than 60 degrees, by 120 at vertex 0 (from 0)"));
}

/// A rod that two others cross, the second turned about it.
TEST(LinkageRemarks, SidesThatAreAGuessAreReported) {
  const auto remarks = [](double turn) {
    const Eigen::Vector3d across(0, std::cos(turn), std::sin(turn)), end(1, 0, 0);
    return remarks_of({{0, 0, 0}, end, {0, 1, 0}, {0, -1, 0}, end + across, end - across},
                      {{0, 1}, {2, 0}, {0, 3}, {4, 1}, {1, 5}});
  };
  EXPECT_TRUE(remarks(1.0).empty());
  ASSERT_EQ(remarks(1.2).size(), 1U);
  EXPECT_THAT(remarks(1.2)[0], ::testing::HasSubstr("along 1 of 5 edges, edge 0 (from 0)"));
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
