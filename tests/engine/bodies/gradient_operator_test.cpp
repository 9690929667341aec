#include "engine/bodies/gradient_operator.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

using testing::box_mesh;
using testing::jitter;

Eigen::VectorXd affine(const TetMesh& mesh, const Eigen::Matrix3d& gradient,
                       const Eigen::Vector3d& shift) {
  const Eigen::Matrix3Xd u = (gradient * mesh.nodes).colwise() + shift;
  return u.reshaped();
}

TEST(GradientOperator, VolumesOfABoxAddUp) {
  const TetMesh mesh = jitter(box_mesh({4, 3, 5}, {2, 1, 0.5}), 0.02);
  const GradientOperator gradient(mesh);
  EXPECT_GT(gradient.volumes().minCoeff(), 0);
  EXPECT_NEAR(gradient.volumes().sum(), 1.0, 1e-13);
  const TetMesh regular = box_mesh({4, 3, 5}, {2, 1, 0.5});
  const GradientOperator even(regular);
  EXPECT_NEAR((even.volumes().array() - 1.0 / regular.tet_count()).abs().maxCoeff(), 0, 1e-16);
}

TEST(GradientOperator, ReproducesAffineMaps) {
  const TetMesh mesh = jitter(box_mesh({3, 3, 3}, {1, 1, 1}), 0.05);
  const GradientOperator gradient(mesh);
  Eigen::Matrix3d h;
  h << 0.1, -0.4, 2, 3, 0.25, -1, 0.5, 0.75, -0.125;
  Eigen::VectorXd g;
  gradient.apply(affine(mesh, h, {5, -7, 9}), g);
  ASSERT_EQ(g.size(), 9 * mesh.tet_count());
  for (int e = 0; e < mesh.tet_count(); ++e) {
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(g[9 * e + 3 * j + i], h(i, j), 1e-12);
    }
  }
}

TEST(GradientOperator, MatrixAndTransposeAgreeWithTheFunctions) {
  const TetMesh mesh = jitter(box_mesh({3, 2, 4}, {1, 2, 1}), 0.05);
  const GradientOperator gradient(mesh);
  Random random(1);
  Eigen::VectorXd u(3 * mesh.node_count()), w(9 * mesh.tet_count());
  for (double& entry : u) entry = random.normal();
  for (double& entry : w) entry = random.normal();
  Eigen::VectorXd g, f;
  gradient.apply(u, g);
  gradient.apply_transposed_weighted(w, f);
  const Eigen::SparseMatrix<double> matrix = gradient.matrix();
  EXPECT_LT((matrix * u - g).norm(), 1e-13 * g.norm());
  const Eigen::VectorXd weights = gradient.volumes()(
      Eigen::VectorXi::LinSpaced(9 * mesh.tet_count(), 0, 9 * mesh.tet_count() - 1).array() / 9);
  EXPECT_LT((matrix.transpose() * weights.cwiseProduct(w) - f).norm(), 1e-13 * f.norm());
}

TEST(GradientOperator, NormalOperatorIsTheLaplacianOnEachAxis) {
  const TetMesh mesh = jitter(box_mesh({3, 2, 2}, {1, 1, 1}), 0.05);
  const GradientOperator gradient(mesh);
  const Eigen::MatrixXd g = gradient.matrix();
  Eigen::VectorXd weights(g.rows());
  for (int row = 0; row < g.rows(); ++row) weights[row] = gradient.volumes()[row / 9];
  const Eigen::MatrixXd normal = g.transpose() * weights.asDiagonal() * g;
  const Eigen::MatrixXd laplacian = gradient.scalar_laplacian();
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(normal.rows(), normal.cols());
  for (int axis = 0; axis < 3; ++axis) {
    for (int b = 0; b < mesh.node_count(); ++b) {
      for (int a = 0; a < mesh.node_count(); ++a) {
        expected(3 * a + axis, 3 * b + axis) = laplacian(a, b);
      }
    }
  }
  EXPECT_LT((normal - expected).norm(), 1e-13 * normal.norm());
  EXPECT_LT((laplacian * Eigen::VectorXd::Ones(mesh.node_count())).norm(), 1e-13);
}

TEST(GradientOperator, KeepsDigitsInASliver) {
  TetMesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes << 0, 1, 0, 0.25, 0, 0, 1, 0.25, 0, 0, 0, 1e-10;
  mesh.tets.resize(4, 1);
  mesh.tets << 0, 1, 2, 3;
  const GradientOperator gradient(mesh);
  Eigen::Matrix3d h;
  h << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  const Eigen::Matrix3d result = gradient.apply(affine(mesh, h, {0, 0, 0}), 0);
  EXPECT_LT((result - h).norm(), 1e-5);
  // The gradients themselves are good to a few ulps: N_3 = z / 1e-10.
  EXPECT_NEAR(gradient.shape_gradients(0)(2, 3) * 1e-10, 1, 1e-15);
}

TEST(GradientOperator, ThreadCountDoesNotMatter) {
  const TetMesh mesh = box_mesh({20, 10, 10}, {2, 1, 1});
  const GradientOperator gradient(mesh);
  Random random(2);
  Eigen::VectorXd u(3 * mesh.node_count());
  for (double& entry : u) entry = random.normal();
  const int threads = thread_count();
  Eigen::VectorXd alone, together;
  set_thread_count(1);
  gradient.apply(u, alone);
  set_thread_count(4);
  gradient.apply(u, together);
  set_thread_count(threads);
  EXPECT_EQ(alone, together);
}

}  // namespace
}  // namespace limber::bodies
