#include "engine/bodies/node_merging.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "engine/base/random.h"

namespace limber::bodies {
namespace {

// The definition, by comparing all pairs.
std::vector<int> brute_force(const NodePositions& nodes, double tolerance) {
  std::vector<int> result;
  for (int a = 0; a < nodes.cols(); ++a) {
    int found = a;
    for (int b = a - 1; b >= 0; --b) {
      if (result[b] == b && (nodes.col(a) - nodes.col(b)).norm() <= tolerance) found = b;
    }
    result.push_back(found);
  }
  return result;
}

TEST(NodeMerging, AgreesWithComparingAllPairs) {
  Random random(4);
  for (const double tolerance : {0.0, 0.01, 0.1, 0.4, 5.0}) {
    NodePositions nodes(3, 600);
    for (double& value : nodes.reshaped()) value = random.uniform(-1, 1);
    nodes.rightCols(100) = nodes.leftCols(100);
    EXPECT_EQ(merge_near_nodes(nodes, tolerance), brute_force(nodes, tolerance)) << tolerance;
  }
}

TEST(NodeMerging, ChainsDoNotCollapse) {
  NodePositions nodes(3, 5);
  nodes.setZero();
  nodes.row(0) << 0, 0.9, 1.8, 2.7, 3.6;
  EXPECT_EQ(merge_near_nodes(nodes, 1), (std::vector<int>{0, 0, 2, 2, 4}));
}

TEST(NodeMerging, ExtremeRatiosOfSizeAndTolerance) {
  NodePositions nodes(3, 4);
  nodes << 1e12, -1e12, 1e12, 0, 0, 0, 0, 0, 0, 0, 1e-9, 0;
  EXPECT_EQ(merge_near_nodes(nodes, 1e-300), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(merge_near_nodes(nodes, 1e-8), (std::vector<int>{0, 1, 0, 3}));
  EXPECT_EQ(merge_near_nodes(nodes, 1e200), (std::vector<int>{0, 0, 0, 0}));
  EXPECT_TRUE(merge_near_nodes(NodePositions(3, 0), 1).empty());
}

}  // namespace
}  // namespace limber::bodies
