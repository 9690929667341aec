#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/bodies/modal_analysis.h"
#include "tests/engine/bodies/box_mesh.h"
#include "tests/engine/bodies/modal_checks.h"

namespace limber::bodies {
namespace {

using testing::box_body;
using testing::box_mesh;
using testing::expect_orthonormal;
using testing::Hold;
using testing::modes_of;
using testing::worst_energy_residual;
using testing::worst_relative_residual;

/// Gives the tets whose centre satisfies `where` a stiffness `contrast` times the first material's.
void stiffen(ElasticBody& body, double contrast,
             const std::function<bool(const Eigen::Vector3d&)>& where) {
  Material stiff = body.mesh.materials[0];
  stiff.youngs_modulus *= contrast;
  body.mesh.materials.push_back(stiff);
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    const Eigen::Vector3d centre =
        body.mesh.nodes(Eigen::all, body.mesh.tets.col(e)).rowwise().mean();
    if (where(centre)) body.mesh.tet_material[e] = 1;
  }
}

/// Strain energy of a mode tet by tet, from differences: independent of K and of its rounding.
double elementwise_rayleigh(const ElasticBody& body, const Eigen::VectorXd& mode) {
  const GradientOperator gradient(body.mesh);
  double energy = 0;
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    const Eigen::Matrix3d h = gradient.apply(mode, e);
    const Eigen::Matrix3d strain = (h + h.transpose()) / 2;
    const Material& material = body.mesh.material_of(e);
    const double trace = strain.trace();
    energy += gradient.volumes()[e] * (material.lame_lambda() * trace * trace +
                                       2 * material.lame_mu() * strain.squaredNorm());
  }
  return energy;
}

TEST(ModalHardCases, NearlyIncompressible) {
  for (const Hold hold : {Hold::kLeftFace, Hold::kFree}) {
    const ElasticBody body = box_body({12, 4, 4}, {3, 1, 1}, hold, {1e6, 0.4999, 1000});
    const ModalBasis basis = modes_of(body, 25);
    EXPECT_LT(basis.max_residual, 1e-8);
    EXPECT_LT(worst_relative_residual(body, basis), 1e-7);
    expect_orthonormal(body, basis);
    for (int k = basis.rigid_count; k < basis.modes.cols(); ++k) {
      const double lambda = basis.eigenvalues[k];
      EXPECT_NEAR(elementwise_rayleigh(body, basis.modes.col(k)), lambda, 1e-9 * lambda);
    }
  }
}

/// Squared frequencies of sheets of cells that lock do not depend on their thickness.
TEST(ModalHardCases, FlatCells) {
  const auto sheet = [](double thickness) {
    return modes_of(box_body({12, 4, 4}, {1, 0.3, thickness}, Hold::kLeftFace), 15);
  };
  const ModalBasis sound = sheet(1e-3), flat = sheet(1e-6);
  EXPECT_LT(sound.eigenvalue_error, 1e-6);
  EXPECT_LT(flat.max_residual, 1e-8) << "which says nothing here";
  EXPECT_GT(flat.eigenvalue_error, 1e-5);
  EXPECT_LT(flat.eigenvalue_error, 1e-2);
  const double off = std::abs(flat.eigenvalues[0] / sound.eigenvalues[0] - 1);
  EXPECT_GT(off, 1e-5);
  EXPECT_LT(off, 30 * flat.eigenvalue_error) << "r itself has rounded";
}

TEST(ModalHardCases, StiffnessContrast1e8WithTheHeldHalfStiff) {
  // The stiff half is a wall: the modes are those of the soft half held at its end.
  ElasticBody body = box_body({16, 4, 4}, {4, 1, 1}, Hold::kLeftFace);
  stiffen(body, 1e8, [](const Eigen::Vector3d& x) { return x.x() < 2; });
  const ModalBasis basis = modes_of(body, 20);
  const ModalBasis half = modes_of(box_body({8, 4, 4}, {2, 1, 1}, Hold::kLeftFace), 20);
  for (int k = 0; k < 20; ++k) {
    EXPECT_NEAR(basis.eigenvalues[k], half.eigenvalues[k], 1e-6 * half.eigenvalues[k]) << k;
  }
  EXPECT_LT(worst_energy_residual(body, basis), 1e-8);
  expect_orthonormal(body, basis);
}

TEST(ModalHardCases, StiffnessContrast1e8WithTheFreeHalfStiff) {
  // A rigid block on a soft spring; beyond 1e6 the contrast no longer matters.
  ElasticBody body = box_body({16, 4, 4}, {4, 1, 1}, Hold::kLeftFace);
  ElasticBody milder = body, harder = body;
  const auto right = [](const Eigen::Vector3d& x) { return x.x() > 2; };
  stiffen(milder, 1e6, right);
  stiffen(body, 1e8, right);
  stiffen(harder, 1e10, right);
  const ModalBasis limit = modes_of(milder, 20);
  const ModalBasis basis = modes_of(body, 20);
  const ModalBasis extreme = modes_of(harder, 20);
  for (int k = 0; k < 20; ++k) {
    EXPECT_NEAR(basis.eigenvalues[k], limit.eigenvalues[k], 2e-6 * limit.eigenvalues[k]) << k;
    EXPECT_NEAR(extreme.eigenvalues[k], limit.eigenvalues[k], 1e-3 * limit.eigenvalues[k]) << k;
  }
  EXPECT_LT(worst_energy_residual(body, basis), 1e-6);  // of the assembled K, which has rounded
  expect_orthonormal(body, basis);
}

TEST(ModalHardCases, StiffnessContrast1e8InLayersOfAFreeBody) {
  ElasticBody body = box_body({16, 4, 4}, {4, 1, 1}, Hold::kFree);
  stiffen(body, 1e8, [](const Eigen::Vector3d& x) { return std::fmod(x.x(), 1.0) < 0.5; });
  const ModalBasis basis = modes_of(body, 20);
  EXPECT_EQ(basis.rigid_count, 6);
  EXPECT_EQ(basis.mechanism_count, 0);
  EXPECT_LT(worst_energy_residual(body, basis), 1e-6);
  expect_orthonormal(body, basis);
  // Eigenvalues grow with the contrast, and not beyond the limit of rigid layers.
  ElasticBody milder = body, harder = body;
  milder.mesh.materials[1].youngs_modulus /= 100;
  harder.mesh.materials[1].youngs_modulus *= 10;
  const ModalBasis below = modes_of(milder, 20), above = modes_of(harder, 20);
  for (int k = 6; k < basis.modes.cols(); ++k) {
    const double lambda = basis.eigenvalues[k];
    EXPECT_NEAR(below.eigenvalues[k], lambda, 1e-5 * lambda) << k;
    EXPECT_NEAR(above.eigenvalues[k], lambda, 1e-6 * lambda) << k;
  }
}

TEST(ModalHardCases, MillimetresAndMetresGiveTheSameMotion) {
  // E in Pa = kg / (m s^2): in mm and kg it is E / 1000, the density is rho / 1e9; eigenvalues are
  // 1/s^2 in both.
  for (const Hold hold : {Hold::kLeftFace, Hold::kFree}) {
    const ElasticBody metres = box_body({10, 3, 4}, {2, 0.5, 0.7}, hold, {2e5, 0.4, 1100});
    const ElasticBody millimetres =
        box_body({10, 3, 4}, {2000, 500, 700}, hold, {2e2, 0.4, 1.1e-6});
    const ModalBasis a = modes_of(metres, 15), b = modes_of(millimetres, 15);
    for (int k = a.rigid_count; k < a.modes.cols(); ++k) {
      EXPECT_NEAR(a.eigenvalues[k], b.eigenvalues[k], 1e-10 * a.eigenvalues[k]);
      EXPECT_LT((a.modes.col(k) - b.modes.col(k)).norm(), 1e-7 * a.modes.col(k).norm()) << k;
    }
  }
}

TEST(ModalHardCases, UnitsFarFromOne) {
  const ModalBasis plain = modes_of(box_body({8, 3, 3}, {4, 1, 1}, Hold::kFree, {1, 0.3, 1}), 12);
  const ModalBasis stiff =
      modes_of(box_body({8, 3, 3}, {4e-3, 1e-3, 1e-3}, Hold::kFree, {1e14, 0.3, 1e-3}), 12);
  const ModalBasis soft =
      modes_of(box_body({8, 3, 3}, {4e3, 1e3, 1e3}, Hold::kFree, {1, 0.3, 1e6}), 12);
  const Eigen::VectorXd expected = plain.eigenvalues.tail(12);
  EXPECT_LT((stiff.eigenvalues.tail(12) / 1e23 - expected).norm(), 1e-9 * expected.norm());
  EXPECT_LT((soft.eigenvalues.tail(12) * 1e12 - expected).norm(), 1e-9 * expected.norm());
}

TEST(ModalHardCases, FarFromTheOrigin) {
  ElasticBody body = box_body({8, 3, 3}, {4, 1, 1}, Hold::kFree);
  const ModalBasis near = modes_of(body, 12);
  body.mesh.nodes.colwise() += Eigen::Vector3d(1024, -2048, 512);
  const ModalBasis far = modes_of(body, 12);
  EXPECT_LT((near.eigenvalues - far.eigenvalues).norm(), 1e-9 * near.eigenvalues.norm());
  expect_orthonormal(body, far);
}

TEST(ModalHardCases, Slivers) {
  // Cells flattened ten-thousandfold: mean ratios of 1e-3, stiffness over mass a hundred million
  // times larger across.
  ElasticBody body = box_body({12, 4, 4}, {3, 1, 1e-4}, Hold::kLeftFace);
  const ModalBasis basis = modes_of(body, 15);
  EXPECT_LT(worst_energy_residual(body, basis), 1e-6);
  expect_orthonormal(body, basis);
  for (int k = 0; k < 15; ++k) {
    const double lambda = basis.eigenvalues[k];
    EXPECT_NEAR(elementwise_rayleigh(body, basis.modes.col(k)), lambda, 1e-9 * lambda);
  }
}

TEST(ModalHardCases, OneSliverInASoundBody) {
  // A node of the middle is pushed almost into the opposite face of one of its tets.
  ElasticBody body = box_body({8, 4, 4}, {2, 1, 1}, Hold::kLeftFace);
  TetMesh& mesh = body.mesh;
  const Eigen::Vector4i tet = mesh.tets.col(mesh.tet_count() / 2 + 3);
  Eigen::Vector3d face = Eigen::Vector3d::Zero();
  for (int a = 1; a < 4; ++a) face += mesh.nodes.col(tet[a]) / 3;
  mesh.nodes.col(tet[0]) = face + 1e-6 * (mesh.nodes.col(tet[0]) - face);
  const PreparedMesh prepared = [&]() -> PreparedMesh {
    try {
      return prepare_mesh(mesh, body.fixed_nodes);
    } catch (const Error& error) {
      ADD_FAILURE() << error.what();
      return {};
    }
  }();
  ASSERT_GT(prepared.mesh.tet_count(), 0);
  body.mesh = prepared.mesh;
  const ModalBasis basis = modes_of(body, 15);
  EXPECT_LT(worst_energy_residual(body, basis), 1e-6);
  expect_orthonormal(body, basis);
}

TEST(ModalHardCases, PartsThatFoldAboutAnEdgeAreMechanisms) {
  TetMesh mesh = box_mesh({4, 4, 4}, {1, 1, 1});
  const int n = mesh.node_count(), m = mesh.tet_count();
  mesh.nodes.conservativeResize(3, 2 * n);
  mesh.nodes.rightCols(n) = mesh.nodes.leftCols(n).colwise() + Eigen::Vector3d(1, 1, 0);
  mesh.tets.conservativeResize(4, 2 * m);
  mesh.tets.rightCols(m) = mesh.tets.leftCols(m).array() + n;
  mesh.tet_material.assign(2 * m, 0);
  ElasticBody body{prepare_mesh(mesh, {}, {.merge_tolerance = 1e-9}).mesh, {}};

  const ModalBasis free = modes_of(body, 12);
  EXPECT_EQ(free.rigid_count, 6);
  EXPECT_EQ(free.mechanism_count, 1);
  EXPECT_DOUBLE_EQ(free.eigenvalues[6], 1e-4 * free.eigenvalues[7]);
  expect_orthonormal(body, free);
  EXPECT_LT(elementwise_rayleigh(body, free.modes.col(6)), 1e-9 * free.eigenvalues[7]);

  for (int a = 0; a < body.mesh.node_count(); ++a) {
    if (body.mesh.nodes(0, a) == 0) body.fixed_nodes.push_back(a);
  }
  const ModalBasis held = modes_of(body, 12);
  EXPECT_EQ(held.mechanism_count, 1);
  expect_orthonormal(body, held);
}

TEST(ModalHardCases, BodiesHeldAtOneOrTwoNodesSwing) {
  ElasticBody body = box_body({8, 4, 4}, {2, 1, 1}, Hold::kFree);
  body.fixed_nodes = {0};
  EXPECT_EQ(modes_of(body, 12).mechanism_count, 3);
  body.fixed_nodes = {0, 8};
  EXPECT_EQ(modes_of(body, 12).mechanism_count, 1);
  body.fixed_nodes = {0, 8, 9};
  const ModalBasis held = modes_of(body, 12);
  EXPECT_EQ(held.mechanism_count, 0);
  EXPECT_GT(held.eigenvalues[0], 0);
  expect_orthonormal(body, held);
}

}  // namespace
}  // namespace limber::bodies
