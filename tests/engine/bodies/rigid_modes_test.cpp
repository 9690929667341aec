#include "engine/bodies/rigid_modes.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/bodies/mass.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

using testing::box_mesh;
using testing::jitter;

TEST(RigidModes, InertiaOfABox) {
  TetMesh mesh = box_mesh({4, 2, 3}, {2, 1, 3}, {1e6, 0.3, 10});
  mesh.nodes.colwise() += Eigen::Vector3d(7, 8, 9);
  const RigidModes rigid = rigid_modes(mesh);
  EXPECT_NEAR(rigid.mass, 60, 1e-11);
  EXPECT_LT((rigid.centre - Eigen::Vector3d(8, 8.5, 10.5)).norm(), 1e-13);
  const Eigen::Vector3d expected = 60.0 / 12 * Eigen::Vector3d(1 + 9, 4 + 9, 4 + 1);
  EXPECT_LT((rigid.inertia - Eigen::Matrix3d(expected.asDiagonal())).norm(), 1e-11);
}

TEST(RigidModes, AreMassOrthonormalAndInOrder) {
  TetMesh mesh = jitter(box_mesh({4, 2, 3}, {2, 1, 3}), 0.05);
  mesh.materials.push_back({1e6, 0.3, 5000});
  for (int e = 0; e < mesh.tet_count() / 3; ++e) mesh.tet_material[e] = 1;
  const RigidModes rigid = rigid_modes(mesh);
  const Eigen::MatrixXd gram = rigid.modes.transpose() * mass_matrix(mesh) * rigid.modes;
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(6, 6)).norm(), 1e-12);
  for (int axis = 0; axis < 3; ++axis) {
    for (int a = 0; a < mesh.node_count(); ++a) {
      const Eigen::Vector3d expected = Eigen::Vector3d::Unit(axis) / std::sqrt(rigid.mass);
      EXPECT_EQ((rigid.modes.block<3, 1>(3 * a, axis)), expected);
      const Eigen::Vector3d turn = rigid.angular.col(axis).cross(mesh.nodes.col(a) - rigid.centre);
      EXPECT_LT((rigid.modes.block<3, 1>(3 * a, 3 + axis) - turn).norm(), 1e-14);
    }
    EXPECT_GT(rigid.angular(axis, axis), 0.7 * rigid.angular.col(axis).norm());
  }
}

}  // namespace
}  // namespace limber::bodies
