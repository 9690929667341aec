#include "engine/bodies/mass.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/bodies/gradient_operator.h"
#include "tests/engine/bodies/box_mesh.h"
#include "tests/support/dense.h"

namespace limber::bodies {
namespace {

using testing::box_mesh;
using testing::jitter;

TetMesh two_densities() {
  TetMesh mesh = jitter(box_mesh({4, 3, 3}, {2, 1, 1}), 0.03);
  mesh.materials = {{1e6, 0.3, 1000}, {1e6, 0.3, 250}};
  for (int e = 0; e < mesh.tet_count(); ++e) mesh.tet_material[e] = e % 2;
  return mesh;
}

TEST(Mass, SumsToDensityTimesVolume) {
  const TetMesh mesh = two_densities();
  const Eigen::VectorXd volumes = GradientOperator(mesh).volumes();
  double total = 0;
  for (int e = 0; e < mesh.tet_count(); ++e) total += (e % 2 == 0 ? 1000 : 250) * volumes[e];
  EXPECT_NEAR(lumped_node_mass(mesh).sum(), total, 1e-11 * total);
  EXPECT_NEAR(consistent_node_mass(mesh).sum(), total, 1e-11 * total);
  EXPECT_NEAR(mass_matrix(mesh).sum(), 3 * total, 1e-11 * total);
  EXPECT_GT(lumped_node_mass(mesh).minCoeff(), 0);
}

TEST(Mass, LumpedIsTheRowSumOfConsistent) {
  const TetMesh mesh = two_densities();
  const Eigen::VectorXd rows =
      consistent_node_mass(mesh) * Eigen::VectorXd::Ones(mesh.node_count());
  EXPECT_LT((rows - lumped_node_mass(mesh)).norm(), 1e-13 * rows.norm());
}

TEST(Mass, ConsistentIntegratesLinearFieldsExactly) {
  // Integral of x^2 and x y over the box [0, 2] x [0, 1]^2 with density 3, on an uneven mesh with
  // flat sides.
  TetMesh mesh = box_mesh({3, 2, 2}, {2, 1, 1}, {1e6, 0.3, 3});
  for (int a = 0; a < mesh.node_count(); ++a) {
    double& x = mesh.nodes(0, a);
    x = x * x / 2;
  }
  const Eigen::SparseMatrix<double> mass = consistent_node_mass(mesh);
  const Eigen::VectorXd x = mesh.nodes.row(0), y = mesh.nodes.row(1);
  EXPECT_NEAR(x.dot(mass * x), 3 * 8.0 / 3, 1e-13 * 8);
  EXPECT_NEAR(x.dot(mass * y), 3 * 2 * 0.5, 1e-13 * 8);
}

TEST(Mass, MatrixActsAlikeOnTheAxes) {
  const TetMesh mesh = two_densities();
  const Eigen::MatrixXd full = mass_matrix(mesh);
  const Eigen::MatrixXd node = consistent_node_mass(mesh);
  for (int a = 0; a < mesh.node_count(); ++a) {
    for (int b = 0; b < mesh.node_count(); ++b) {
      const Eigen::Matrix3d block = full.block<3, 3>(3 * a, 3 * b);
      EXPECT_EQ(block, node(a, b) * Eigen::Matrix3d::Identity());
    }
  }
  EXPECT_TRUE(reference::is_positive_definite(full));
}

}  // namespace
}  // namespace limber::bodies
