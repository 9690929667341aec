// What is said of lines that touch where nothing joins them.

#include "engine/session/linkage/linkage_remarks.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace limber::session
