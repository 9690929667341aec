#include "engine/rods/design/cell_area.h"

#include <gtest/gtest.h>

#include "engine/rods/linkage/linkage_graph.h"
#include "tests/engine/rods/design/small_designs.h"

namespace limber::rods {
namespace {

/// Rods along x and y, so many cells in each direction.
LinkageModel flat_grid(int cells_x, int cells_y, double width, double height) {
  LineMesh mesh;
  const int columns = cells_x + 1, rows = cells_y + 1;
  mesh.vertices.resize(3, columns * rows);
  std::vector<Eigen::Vector2i> edges;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      mesh.vertices.col(r * columns + c) << c * width, r * height, 0;
      if (c + 1 < columns) edges.emplace_back(r * columns + c, r * columns + c + 1);
      if (r + 1 < rows) edges.emplace_back(r * columns + c, (r + 1) * columns + c);
    }
  }
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    mesh.edges.col(static_cast<Eigen::Index>(e)) = edges[e];
  return {build_linkage_graph(mesh), 4, testing::kStrip};
}

TEST(CellArea, OfAFlatGridIsThatOfItsOutline) {
  const LinkageModel model = flat_grid(4, 3, 20, 10);
  CellArea area(model);
  EXPECT_TRUE(area.has_cells());
  EXPECT_NEAR(area.value(LinkageState(model)), 4 * 3 * 20 * 10, 1e-9);
}

TEST(CellArea, OfALinkageWithoutCellsIsNothing) {
  LineMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0;
  mesh.edges.resize(2, 3);
  mesh.edges << 0, 1, 2, 1, 2, 3;
  const LinkageModel model(build_linkage_graph(mesh), 4, testing::kStrip);
  CellArea area(model);
  EXPECT_FALSE(area.has_cells());
  EXPECT_EQ(area.value(LinkageState(model)), 0);
}

TEST(CellArea, DerivativesAgreeWithDifferences) {
  const testing::SmallDesign problem = testing::curved_design();
  const LinkageModel& model = problem.model;
  const LinkageState state = problem.start->deployed;
  CellArea area(model);
  ASSERT_TRUE(area.has_cells());
  constexpr double kStep = 1e-3, kWeight = 0.7;
  const auto gradient = [&](const LinkageState& at) {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(model.variables().size());
    area.add_gradient(at, kWeight, result);
    return result;
  };
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Eigen::VectorXd v =
        30 * testing::random_direction(model.variables().size(), seed);  // of lengths of some 30
    const auto moved = [&](double step) {
      return state.moved(model, step * v, LinkageState::Parts::kVertices);
    };
    const auto slope = [&](double step) {
      return kWeight * (area.value(moved(step)) - area.value(moved(-step))) / (2 * step);
    };
    const Eigen::VectorXd by = gradient(state);
    EXPECT_NEAR(by.dot(v), (4 * slope(kStep) - slope(2 * kStep)) / 3, 1e-8 * by.norm() * v.norm());
    Eigen::VectorXd second = Eigen::VectorXd::Zero(v.size());
    area.add_second(state, v, kWeight, second);
    const Eigen::VectorXd difference =
        (gradient(moved(kStep)) - gradient(moved(-kStep))) / (2 * kStep);
    EXPECT_LT((second - difference).norm(), 1e-6 * second.norm());
  }
}

}  // namespace
}  // namespace limber::rods
