#include "engine/rods/design/linkage_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "engine/base/error.h"
#include "engine/rods/design/mesh_surface.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

Eigen::Matrix3Xd drawn(const LinkageGraph& graph) {
  Eigen::Matrix3Xd positions(3, static_cast<Eigen::Index>(graph.joints.size()));
  for (std::size_t j = 0; j < graph.joints.size(); ++j)
    positions.col(static_cast<Eigen::Index>(j)) = graph.joints[j].position;
  return positions;
}

/// A grid that is bent round to a tube: rows close, columns are open at both ends.
LineMesh tube(int around, int along) {
  LineMesh mesh;
  mesh.vertices.resize(3, Eigen::Index{around} * along);
  mesh.edges.resize(2, Eigen::Index{2} * around * (along - 1));
  int e = 0;
  for (int r = 0; r < along; ++r) {
    for (int c = 0; c < around; ++c) {
      const double angle = 2 * M_PI * (c + 0.5 * r) / around;
      mesh.vertices.col(r * around + c) << std::cos(angle), std::sin(angle), 0.3 * r;
      if (r + 1 == along) continue;
      mesh.edges.col(e++) << r * around + c, (r + 1) * around + c;
      mesh.edges.col(e++) << r * around + c, (r + 1) * around + (c + around - 1) % around;
    }
  }
  return mesh;
}

TEST(LinkageCells, AGridHasItsCells) {
  for (const double angle : {0.3, 1.2, 2.0}) {
    const LinkageGraph graph = build_linkage_graph(testing::sheared_grid(4, 3, angle));
    const auto cells = linkage_cells(graph);
    std::set<std::set<int>> found;
    for (const auto& cell : cells) {
      EXPECT_EQ(cell.size(), 4);
      found.insert({cell.begin(), cell.end()});
    }
    std::set<std::set<int>> expected;
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < 3; ++c)
        expected.insert({4 * r + c, 4 * r + c + 1, 4 * r + c + 4, 4 * r + c + 5});
    EXPECT_EQ(found, expected);
  }
}

TEST(LinkageCells, OpeningsOfATubeAreNoCells) {
  const LinkageGraph graph = build_linkage_graph(tube(12, 5));
  const auto cells = linkage_cells(graph);
  EXPECT_EQ(cells.size(), 12 * 3);
  for (const auto& cell : cells) EXPECT_EQ(cell.size(), 4);
}

TEST(LinkageCells, FreeEndsBoundNothing) {
  const LinkageGraph graph = build_linkage_graph(testing::mixed_mesh());
  EXPECT_EQ(linkage_cells(graph).size(), 4);
}

TEST(LinkageCells, PublicLinkagesAreSurfaces) {
  for (const testing::KnownLinkage& known : testing::known_linkages()) {
    const auto path = testing::linkage_file(known.name);
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
    const LinkageGraph graph = build_linkage_graph(scene::read_line_mesh_file(path));
    if (graph.joints.size() < 40) continue;
    std::map<std::pair<int, int>, int> sides;
    for (const auto& cell : linkage_cells(graph)) {
      EXPECT_LE(cell.size(), 8) << known.name;
      for (std::size_t k = 0; k < cell.size(); ++k) ++sides[{cell[k], cell[(k + 1) % cell.size()]}];
    }
    for (const auto& [side, times] : sides) EXPECT_EQ(times, 1) << known.name;
    // Every segment between two joints has a cell on a side.
    int bare = 0;
    for (const Segment& segment : graph.segments) {
      const int a = segment.joints[kStart], b = segment.joints[kFinish];
      if (a >= 0 && b >= 0 && !sides.contains({a, b}) && !sides.contains({b, a})) ++bare;
    }
    EXPECT_EQ(bare, 0) << known.name;
  }
}

TEST(SurfaceThroughJoints, PassesThroughThem) {
  const LinkageGraph graph = build_linkage_graph(tube(10, 4));
  const Eigen::Matrix3Xd positions = drawn(graph);
  const MeshSurface surface(surface_through_joints(graph, positions));
  for (Eigen::Index j = 0; j < positions.cols(); ++j)
    EXPECT_LT((surface.closest(positions.col(j)).position - positions.col(j)).norm(), 1e-14);
  EXPECT_GT(surface.closest({0, 0, 0.45}).position.head<2>().norm(), 0.8);  // nothing spans it
}

TEST(SurfaceThroughJoints, ALinkageWithoutCellsIsRefused) {
  LineMesh cross;
  cross.vertices.resize(3, 5);
  cross.vertices << -1, 1, 0, -1, 1, -1, 1, 0, 1, -1, 0, 0, 0, 0, 0;
  cross.edges.resize(2, 4);
  cross.edges << 0, 2, 3, 2, 2, 1, 2, 4;
  const LinkageGraph graph = build_linkage_graph(cross);
  try {
    (void)surface_through_joints(graph, drawn(graph));
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "surface.triangles");
  }
}

}  // namespace
}  // namespace limber::rods
