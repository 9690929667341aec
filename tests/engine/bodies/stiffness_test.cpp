#include "engine/bodies/stiffness.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/random.h"
#include "engine/bodies/rigid_modes.h"
#include "tests/engine/bodies/box_mesh.h"
#include "tests/support/dense.h"

namespace limber::bodies {
namespace {

using testing::box_mesh;
using testing::jitter;

// Energy density lambda/2 tr(eps)^2 + mu eps : eps, written independently of the element matrix.
double energy(const TetMesh& mesh, const Eigen::VectorXd& u) {
  double total = 0;
  for (int e = 0; e < mesh.tet_count(); ++e) {
    Eigen::Matrix3d rest, moved;
    for (int a = 0; a < 3; ++a) {
      rest.col(a) = mesh.nodes.col(mesh.tets(a + 1, e)) - mesh.nodes.col(mesh.tets(0, e));
      moved.col(a) = u.segment<3>(3 * mesh.tets(a + 1, e)) - u.segment<3>(3 * mesh.tets(0, e));
    }
    const Eigen::Matrix3d h = moved * rest.inverse();
    const Eigen::Matrix3d strain = (h + h.transpose()) / 2;
    const Material& m = mesh.materials[mesh.tet_material[e]];
    const double mu = m.youngs_modulus / 2 / (1 + m.poissons_ratio);
    const double lambda = 2 * mu * m.poissons_ratio / (1 - 2 * m.poissons_ratio);
    const double trace = strain.trace();
    total += rest.determinant() / 6 * (lambda / 2 * trace * trace + mu * strain.squaredNorm());
  }
  return total;
}

TetMesh two_materials() {
  TetMesh mesh = jitter(box_mesh({4, 3, 3}, {2, 1, 1}), 0.03);
  mesh.materials = {{1e6, 0.3, 1000}, {2e4, -0.2, 250}};
  for (int e = 0; e < mesh.tet_count(); ++e) mesh.tet_material[e] = e % 3 == 0;
  return mesh;
}

Eigen::VectorXd random_vector(Eigen::Index size, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd result(size);
  for (double& entry : result) entry = random.normal();
  return result;
}

TEST(Stiffness, QuadraticFormIsTheStrainEnergy) {
  const TetMesh mesh = two_materials();
  const Eigen::SparseMatrix<double> stiffness = stiffness_matrix(mesh);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Eigen::VectorXd u = random_vector(3 * mesh.node_count(), seed);
    const double expected = energy(mesh, u);
    EXPECT_NEAR(0.5 * u.dot(stiffness * u), expected, 1e-12 * expected);
  }
}

TEST(Stiffness, IsSymmetricAndPositiveSemidefinite) {
  const TetMesh mesh = two_materials();
  const Eigen::MatrixXd stiffness = stiffness_matrix(mesh);
  EXPECT_LT((stiffness - stiffness.transpose()).norm(), 1e-14 * stiffness.norm());
  const Eigen::VectorXd values = reference::symmetric_eigenvalues(stiffness);
  EXPECT_GT(values[0], -1e-12 * values[values.size() - 1]);
  EXPECT_LT(values[5], 1e-12 * values[values.size() - 1]);
  EXPECT_GT(values[6], 1e-6 * values[values.size() - 1]) << "only rigid motions are free";
}

TEST(Stiffness, RigidModesAreInTheKernel) {
  TetMesh mesh = two_materials();
  mesh.nodes.colwise() += Eigen::Vector3d(100, -50, 20);
  const Eigen::SparseMatrix<double> stiffness = stiffness_matrix(mesh);
  const Eigen::MatrixXd modes = rigid_modes(mesh).modes;
  EXPECT_LT((stiffness * modes).norm(), 1e-12 * stiffness.norm() * modes.norm());
}

TEST(Stiffness, PatchTestOfConstantStrain) {
  // Uniaxial stress in x: strains (s/E, -nu s/E, -nu s/E); forces vanish inside and carry s on the
  // end faces.
  const Material material{2e6, 0.35, 1000};
  const TetMesh mesh = jitter(box_mesh({4, 3, 3}, {2, 1, 1}, material), 0.05);
  const double stress = 1e3;
  const double strain = stress / material.youngs_modulus;
  const Eigen::Vector3d stretch(strain, -0.35 * strain, -0.35 * strain);
  const Eigen::Matrix3Xd u = stretch.asDiagonal() * mesh.nodes;
  const Eigen::VectorXd flat = u.reshaped();
  const Eigen::VectorXd forces = stiffness_matrix(mesh) * flat;
  double right = 0, elsewhere = 0;
  for (int a = 0; a < mesh.node_count(); ++a) {
    const Eigen::Vector3d force = forces.segment<3>(3 * a);
    if (mesh.nodes(0, a) == 2) {
      right += force.x();
      elsewhere += force.tail<2>().norm();
    } else if (mesh.nodes(0, a) > 0) {
      elsewhere += force.norm();
    }
  }
  EXPECT_NEAR(right, stress * 1.0, 1e-10 * stress);
  EXPECT_NEAR(elsewhere, 0, 1e-10 * stress);
}

}  // namespace
}  // namespace limber::bodies
