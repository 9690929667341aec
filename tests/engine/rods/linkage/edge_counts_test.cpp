#include "engine/rods/linkage/edge_counts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::rods {
namespace {

using ::testing::ElementsAre;

/// A rod along x with joints where short rods across it have their middles; it ends free.
std::vector<int> counts(const std::vector<double>& lengths, int edges) {
  const int joints = static_cast<int>(lengths.size()) - 1;
  LineMesh mesh;
  mesh.vertices.resize(3, joints + 2 + 2 * joints);
  mesh.edges.resize(2, joints + 1 + 2 * joints);
  double x = 0;
  for (int i = 0; i <= joints + 1; ++i) {
    mesh.vertices.col(i) << x, 0, 0;
    if (i <= joints) {
      x += lengths[static_cast<std::size_t>(i)];
      mesh.edges.col(i) << i, i + 1;
    }
  }
  for (int j = 0; j < joints; ++j) {
    for (const int side : {0, 1}) {
      const int v = joints + 2 + 2 * j + side;
      mesh.vertices.col(v) << mesh.vertices(0, j + 1), side == 0 ? 1 : -1, 0;
      mesh.edges.col(joints + 1 + 2 * j + side) << j + 1, v;
    }
  }
  std::vector<int> all = edges_by_length(build_linkage_graph(mesh), edges);
  all.resize(static_cast<std::size_t>(joints) + 1);
  return all;
}

TEST(EdgesByLength, SegmentsLikeTheOthersHaveTheRequestedNumber) {
  EXPECT_THAT(counts({1, 2, 0.11, 50, 1}, 10), ElementsAre(10, 10, 10, 10, 10));
}

TEST(EdgesByLength, ShortOnesKeepTheLengthOfTheirEdgesOrWhatTheirEndsDemand) {
  // Median 1, typical edge 0.1, none shorter than 0.01 where there may be fewer.
  EXPECT_THAT(counts({1, 0.0499, 0.041, 0.001, 1e-5, 0.001}, 10), ElementsAre(10, 4, 4, 3, 3, 2));
}

TEST(EdgesByLength, FewStayFew) { EXPECT_THAT(counts({1, 0.001, 1}, 3), ElementsAre(3, 3, 3)); }

}  // namespace
}  // namespace limber::rods
