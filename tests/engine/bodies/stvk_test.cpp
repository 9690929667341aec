#include "engine/bodies/stvk.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/bodies/stiffness.h"
#include "tests/engine/bodies/box_mesh.h"
#include "tests/support/dense.h"
#include "tests/support/energy_conformance.h"

namespace limber::bodies {
namespace {

using testing::box_mesh;
using testing::jitter;
using Curvature = StvkEnergy::Curvature;

Eigen::VectorXd random_displacement(const TetMesh& mesh, double amount, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd u(3 * mesh.node_count());
  for (double& value : u) value = random.uniform(-amount, amount);
  return u;
}

/// A rigid motion of the deformed shape X + u.
Eigen::VectorXd moved(const TetMesh& mesh, const Eigen::VectorXd& u,
                      const Eigen::Vector3d& rotation, const Eigen::Vector3d& shift) {
  const Eigen::Matrix3d r = rotations::exponential(rotation);
  Eigen::VectorXd result(u.size());
  for (int a = 0; a < mesh.node_count(); ++a) {
    const Eigen::Vector3d x = mesh.nodes.col(a) + u.segment<3>(3 * a);
    result.segment<3>(3 * a) = r * x + shift - mesh.nodes.col(a);
  }
  return result;
}

struct Body {
  explicit Body(double poissons_ratio = 0.4)
      : mesh(jitter(box_mesh({2, 2, 1}, {1, 0.8, 0.5}, {1, poissons_ratio, 1}), 0.05)) {
    mesh.materials.push_back({40, 0.1, 2});
    for (int tet = 0; tet < mesh.tet_count(); tet += 3) mesh.tet_material[tet] = 1;
  }
  TetMesh mesh;
  GradientOperator gradient{mesh};
  StvkEnergy energy{mesh, gradient};
};

limber::testing::EnergyUnderTest under_test(const Body& body, const StrainMemory& memory) {
  limber::testing::EnergyUnderTest energy;
  energy.value = [&body, memory](const Eigen::VectorXd& u) { return body.energy.value(u, memory); };
  energy.gradient = [&body, memory](const Eigen::VectorXd& u) {
    return body.energy.gradient(u, memory);
  };
  energy.hessian = [&body, memory](const Eigen::VectorXd& u) {
    return Eigen::MatrixXd(body.energy.hessian(u, Curvature::kExact, memory));
  };
  energy.invariances = {[&body](const Eigen::VectorXd& u) {
    return moved(body.mesh, u, {2.0, -0.7, 1.1}, {3, -2, 1});
  }};
  return energy;
}

TEST(Stvk, ConformsAtALargeDeformation) {
  const Body body;
  auto energy = under_test(body, {});
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  energy.zero_states = {rest, moved(body.mesh, rest, {0.4, 3.0, -0.2}, {10, 0, -4})};
  expect_conforms(energy, random_displacement(body.mesh, 0.1, 3));
}

TEST(Stvk, ConformsWithAMemory) {
  const Body body(-0.3);
  const Eigen::VectorXd before = random_displacement(body.mesh, 0.1, 4);
  const StrainMemory memory{body.energy.strains(before), 2.5};
  expect_conforms(under_test(body, memory), random_displacement(body.mesh, 0.1, 5));
  // What is remembered costs nothing itself, turned or not.
  const Eigen::VectorXd turned = moved(body.mesh, before, {1, 1, 0}, {0, 0, 1});
  EXPECT_NEAR(body.energy.value(turned, memory), body.energy.value(before), 1e-10);
}

TEST(Stvk, HessianAtRestIsTheLinearStiffness) {
  const Body body;
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  const Eigen::MatrixXd linear = stiffness_matrix(body.mesh, body.gradient);
  const Eigen::MatrixXd ours = body.energy.hessian(rest, Curvature::kExact);
  EXPECT_LT((ours - linear).norm(), 1e-13 * linear.norm());
}

TEST(Stvk, UniaxialStretchHasTheKnownEnergy) {
  // F = diag(1 + a, 1, 1): E_xx = a + a^2/2, W = V (lambda/2 + mu) E_xx^2.
  const TetMesh mesh = box_mesh({3, 2, 2}, {2, 1, 0.5}, {7, 0.3, 1});
  const GradientOperator gradient(mesh);
  const double stretch = 0.4, strain = stretch + stretch * stretch / 2;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * mesh.node_count());
  for (int a = 0; a < mesh.node_count(); ++a) u[3 * a] = stretch * mesh.nodes(0, a);
  const Material& m = mesh.materials[0];
  EXPECT_NEAR(StvkEnergy(mesh, gradient).value(u),
              1.0 * (m.lame_lambda() / 2 + m.lame_mu()) * strain * strain, 1e-13);
}

TEST(Stvk, PositiveCurvatureIsSemidefiniteWhereTheExactOneIsNot) {
  const Body body;
  Eigen::VectorXd u(3 * body.mesh.node_count());
  for (int a = 0; a < body.mesh.node_count(); ++a)
    u.segment<3>(3 * a) = -0.5 * body.mesh.nodes.col(a);
  const auto lowest = [&](Curvature curvature) {
    const Eigen::MatrixXd h = body.energy.hessian(u, curvature);
    return reference::symmetric_eigenvalues(h)[0] / h.norm();
  };
  EXPECT_LT(lowest(Curvature::kExact), -1e-3);
  EXPECT_GT(lowest(Curvature::kPositive), -1e-13);
}

TEST(Stvk, KeepsItsDigitsCloseToRest) {
  // 1e-12 of the length: the strain is computed from H, so that nothing cancels.
  const Body body;
  const Eigen::VectorXd direction = random_displacement(body.mesh, 1, 6);
  const double tiny = 1e-12;
  const double quadratic =
      tiny * tiny * direction.dot(stiffness_matrix(body.mesh, body.gradient) * direction) / 2;
  EXPECT_NEAR(body.energy.value(tiny * direction), quadratic, 1e-9 * quadratic);
}

TEST(Stvk, NamesTheTetThatIsTurnedInsideOut) {
  const Body body;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  EXPECT_NEAR(body.energy.worst_inversion(u).smallest, 1, 1e-15);
  const int node = body.mesh.tets(0, 5);
  u.segment<3>(3 * node).setConstant(3.0);
  const auto worst = body.energy.worst_inversion(u);
  EXPECT_LT(worst.smallest, 0);
  EXPECT_TRUE((body.mesh.tets.col(worst.tet).array() == node).any());
}

}  // namespace
}  // namespace limber::bodies
