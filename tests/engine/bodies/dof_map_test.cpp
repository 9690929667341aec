#include "engine/bodies/dof_map.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/bodies/stiffness.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

TEST(DofMap, NumbersTheFreeOnes) {
  const DofMap vectors = DofMap::of_vectors(4, {2, 0});
  EXPECT_EQ(vectors.full_of_free(), (std::vector<int>{3, 4, 5, 9, 10, 11}));
  EXPECT_EQ(vectors.free_of_full()[9], 3);
  EXPECT_EQ(vectors.free_of_full()[7], -1);
  const DofMap scalars = DofMap::of_scalars(4, {2, 0, 2});
  EXPECT_EQ(scalars.full_of_free(), (std::vector<int>{1, 3}));
  EXPECT_EQ(DofMap::of_vectors(4, {}).free_count(), 12);
}

TEST(DofMap, RestrictsAndExpands) {
  const TetMesh mesh = testing::box_mesh({2, 2, 2}, {1, 1, 1});
  const DofMap dofs = DofMap::of_vectors(mesh.node_count(), {0, 5, 26});
  const Eigen::SparseMatrix<double> full = stiffness_matrix(mesh);
  const Eigen::SparseMatrix<double> free = dofs.restrict_matrix(full);
  EXPECT_TRUE(free.isCompressed());
  const Eigen::MatrixXd dense = full;
  const Eigen::MatrixXd expected = dense(dofs.full_of_free(), dofs.full_of_free());
  EXPECT_EQ(Eigen::MatrixXd(free), expected);
  const Eigen::MatrixXd block =
      Eigen::VectorXd::LinSpaced(3 * dofs.free_count(), 1, 2).reshaped(dofs.free_count(), 3);
  const Eigen::MatrixXd expanded = dofs.expand_rows(block);
  EXPECT_EQ(dofs.restrict_rows(expanded), block);
  EXPECT_EQ(expanded.topRows(3), Eigen::MatrixXd::Zero(3, 3));
  EXPECT_DOUBLE_EQ(expanded.squaredNorm(), block.squaredNorm());
}

}  // namespace
}  // namespace limber::bodies
