#include "engine/bodies/node_graph.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "engine/base/random.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

using testing::box_mesh;

/// Two tets with one node in common; node 3 is in none. Corners in no order.
TetNodes tets_at_a_node() {
  TetNodes tets(4, 2);
  tets.col(0) << 7, 2, 0, 1;
  tets.col(1) << 4, 2, 6, 5;
  return tets;
}

std::vector<int> neighbours_of(const NodeGraph& graph, int node) {
  const auto first = graph.neighbours().begin();
  return {first + graph.starts()[static_cast<std::size_t>(node)],
          first + graph.starts()[static_cast<std::size_t>(node) + 1]};
}

TEST(NodeGraph, NamesTheNodesOfSharedTets) {
  const NodeGraph graph(tets_at_a_node(), 8);
  EXPECT_EQ(graph.node_count(), 8);
  EXPECT_EQ(neighbours_of(graph, 0), (std::vector<int>{0, 1, 2, 7}));
  EXPECT_EQ(neighbours_of(graph, 2), (std::vector<int>{0, 1, 2, 4, 5, 6, 7}));
  EXPECT_EQ(neighbours_of(graph, 3), (std::vector<int>{}));
  EXPECT_EQ(neighbours_of(graph, 7), (std::vector<int>{0, 1, 2, 7}));
}

TEST(NodeGraph, OfABoxAgreesWithSets) {
  const TetMesh mesh = box_mesh({2, 3, 2}, {1, 1, 1});
  std::vector<std::set<int>> expected(static_cast<std::size_t>(mesh.node_count()));
  for (int e = 0; e < mesh.tet_count(); ++e)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        expected[static_cast<std::size_t>(mesh.tets(a, e))].insert(mesh.tets(b, e));
  const NodeGraph graph(mesh.tets, mesh.node_count());
  for (int a = 0; a < mesh.node_count(); ++a) {
    const std::set<int>& all = expected[static_cast<std::size_t>(a)];
    EXPECT_EQ(neighbours_of(graph, a), std::vector<int>(all.begin(), all.end())) << "node " << a;
  }
}

TEST(NodeGraph, WithoutTetsIsEmpty) {
  const NodeGraph graph(TetNodes(4, 0), 3);
  EXPECT_EQ(graph.node_count(), 3);
  EXPECT_TRUE(graph.neighbours().empty());
  const auto matrix = graph.assemble_scalar([](int) { return Eigen::Matrix4d::Ones(); });
  EXPECT_EQ(matrix.rows(), 3);
  EXPECT_EQ(matrix.nonZeros(), 0);
}

TEST(NodeGraph, AssemblesScalarsAsADenseSumWould) {
  const TetMesh mesh = box_mesh({2, 1, 2}, {1, 1, 1});
  Random random(5);
  std::vector<Eigen::Matrix4d> elements(static_cast<std::size_t>(mesh.tet_count()));
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(mesh.node_count(), mesh.node_count());
  for (int e = 0; e < mesh.tet_count(); ++e) {
    Eigen::Matrix4d& element = elements[static_cast<std::size_t>(e)];
    for (double& value : element.reshaped()) value = random.uniform(-1, 1);  // not symmetric
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) expected(mesh.tets(a, e), mesh.tets(b, e)) += element(a, b);
  }
  const NodeGraph graph(mesh.tets, mesh.node_count());
  const auto matrix =
      graph.assemble_scalar([&](int e) { return elements[static_cast<std::size_t>(e)]; });
  EXPECT_EQ(matrix.nonZeros(), static_cast<Eigen::Index>(graph.neighbours().size()));
  EXPECT_LE((Eigen::MatrixXd(matrix) - expected).norm(), 1e-14 * expected.norm());
}

TEST(NodeGraph, AssemblesVectorsAsADenseSumWould) {
  const TetNodes tets = tets_at_a_node();
  Random random(6);
  using Element = Eigen::Matrix<double, 12, 12>;
  std::vector<Element> elements(2);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(24, 24);
  for (int e = 0; e < 2; ++e) {
    Element& element = elements[static_cast<std::size_t>(e)];
    for (double& value : element.reshaped()) value = random.uniform(-1, 1);
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        expected.block<3, 3>(3 * tets(a, e), 3 * tets(b, e)) += element.block<3, 3>(3 * a, 3 * b);
  }
  const NodeGraph graph(tets, 8);
  const auto matrix =
      graph.assemble_vector([&](int e) { return elements[static_cast<std::size_t>(e)]; });
  EXPECT_EQ(matrix.nonZeros(), 9 * static_cast<Eigen::Index>(graph.neighbours().size()));
  EXPECT_EQ((Eigen::MatrixXd(matrix) - expected).norm(), 0);
}

TEST(NodeGraph, ExpandsEachEntryToAMultipleOfTheIdentity) {
  const NodeGraph graph(tets_at_a_node(), 8);
  Eigen::Matrix4d element;
  element << 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16;
  const Eigen::MatrixXd scalar(graph.assemble_scalar([&](int e) { return (e + 1) * element; }));
  const Eigen::MatrixXd expanded(
      NodeGraph::expand_to_axes(graph.assemble_scalar([&](int e) { return (e + 1) * element; })));
  ASSERT_EQ(expanded.rows(), 24);
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b)
      EXPECT_EQ((expanded.block<3, 3>(3 * a, 3 * b)), scalar(a, b) * Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace limber::bodies
