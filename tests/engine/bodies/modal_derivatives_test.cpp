#include "engine/bodies/modal_derivatives.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/stiffness.h"
#include "engine/bodies/stvk.h"
#include "tests/engine/bodies/box_mesh.h"
#include "tests/engine/bodies/modal_checks.h"

namespace limber::bodies {
namespace {

using testing::box_body;
using testing::Hold;
using testing::jitter;
using testing::modes_of;

ElasticBody some_body(Hold hold) {
  ElasticBody body = box_body({5, 2, 2}, {1, 0.4, 0.3}, hold, {2e5, 0.4, 700});
  body.mesh = jitter(body.mesh, 0.02);
  return body;
}

Eigen::VectorXd random_field(const ElasticBody& body, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd field(3 * body.mesh.node_count());
  for (double& value : field) value = random.normal();
  return field;
}

/// omega x u, node by node.
Eigen::VectorXd turned(const Eigen::Vector3d& omega, const Eigen::VectorXd& u) {
  Eigen::VectorXd result(u.size());
  for (Eigen::Index i = 0; i < u.size(); i += 3)
    result.segment<3>(i) = omega.cross(Eigen::Vector3d(u.segment<3>(i)));
  return result;
}

/// K u + load, without the rows of fixed nodes.
Eigen::VectorXd imbalance(const ElasticBody& body, const Eigen::VectorXd& u,
                          const Eigen::VectorXd& load) {
  Eigen::VectorXd rest = stiffness_matrix(body.mesh) * u + load;
  for (const int node : body.fixed_nodes) rest.segment<3>(3 * node).setZero();
  return rest;
}

// The tangent stiffness is quadratic in u: central differences of it are exact but for rounding.
TEST(ModalDerivatives, ForceDerivativeIsThatOfTheTangentStiffness) {
  const ElasticBody body = some_body(Hold::kFree);
  const GradientOperator gradient(body.mesh);
  const StvkEnergy energy(body.mesh, gradient);
  const Eigen::VectorXd p = random_field(body, 1), q = random_field(body, 2);
  const double step = 1e-2;
  const auto tangent = [&](double s) {
    return Eigen::VectorXd(energy.hessian(s * p, StvkEnergy::Curvature::kExact) * q);
  };
  const Eigen::VectorXd expected = (tangent(step) - tangent(-step)) / (2 * step);
  const Eigen::VectorXd value = second_force_derivative(body, p, q);
  EXPECT_LT((value - expected).norm(), 1e-11 * expected.norm());
  EXPECT_LT((value - second_force_derivative(body, q, p)).norm(), 1e-13 * value.norm());
}

// Forces turn with the body: f(turned u) is f(u) turned, to second order in turn and u together.
TEST(ModalDerivatives, ForceDerivativeAlongARotation) {
  const ElasticBody body = some_body(Hold::kFree);
  const Eigen::Vector3d omega(0.3, -1.1, 0.7);
  Eigen::VectorXd rotation(3 * body.mesh.node_count());
  for (int i = 0; i < body.mesh.node_count(); ++i)
    rotation.segment<3>(3 * i) = omega.cross(Eigen::Vector3d(body.mesh.nodes.col(i)));
  const Eigen::VectorXd u = random_field(body, 3);
  const Eigen::SparseMatrix<double> k = stiffness_matrix(body.mesh);
  const Eigen::VectorXd expected = turned(omega, k * u) - k * turned(omega, u);
  EXPECT_LT((second_force_derivative(body, rotation, u) - expected).norm(),
            1e-11 * expected.norm());
}

TEST(ModalDerivatives, HeldBodyIsInBalanceAndSymmetric) {
  const ElasticBody body = some_body(Hold::kLeftFace);
  const ModalBasis basis = modes_of(body, 8);
  const Eigen::MatrixXd value = modal_derivatives(body, basis, {{0, 0}, {1, 4}, {4, 1}});
  EXPECT_LT((value.col(1) - value.col(2)).norm(), 1e-12 * value.col(1).norm());
  for (const auto& [column, pair] : {std::pair{0, ModePair{0, 0}}, std::pair{1, ModePair{1, 4}}}) {
    const Eigen::VectorXd load =
        second_force_derivative(body, basis.modes.col(pair.first), basis.modes.col(pair.second));
    EXPECT_LT(imbalance(body, value.col(column), load).norm(), 1e-9 * load.norm()) << column;
    for (const int node : body.fixed_nodes)
      EXPECT_TRUE(value.col(column).segment<3>(3 * node).isZero(0));
  }
}

TEST(ModalDerivatives, FreeBodyIsInBalanceButForInertia) {
  const ElasticBody body = some_body(Hold::kFree);
  const ModalBasis basis = modes_of(body, 8);
  ASSERT_EQ(6, basis.rigid_count);
  const std::vector<ModePair> pairs = {{6, 6}, {7, 9}, {4, 8}};
  const Eigen::MatrixXd value = modal_derivatives(body, basis, pairs);
  const Eigen::SparseMatrix<double> mass = mass_matrix(body.mesh);
  const Eigen::MatrixXd rigid = basis.modes.leftCols(6);
  for (int i = 0; i < 3; ++i) {
    Eigen::VectorXd load = second_force_derivative(body, basis.modes.col(pairs[i].first),
                                                   basis.modes.col(pairs[i].second));
    load -= mass * (rigid * (rigid.transpose() * load).eval());
    EXPECT_LT(imbalance(body, value.col(i), load).norm(), 1e-6 * load.norm()) << i;
    EXPECT_LT((rigid.transpose() * (mass * value.col(i))).norm(),
              1e-10 * std::sqrt(value.col(i).dot(mass * value.col(i))));
  }
}

// Hard case: held along a line, about which nothing holds it.
TEST(ModalDerivatives, BodyWithAMechanism) {
  ElasticBody body = some_body(Hold::kFree);
  for (int i = 0; i < body.mesh.node_count(); ++i) {
    if (body.mesh.nodes(0, i) == 0 && body.mesh.nodes(1, i) == 0) body.fixed_nodes.push_back(i);
  }
  const ModalBasis basis = modes_of(body, 8);
  ASSERT_EQ(1, basis.mechanism_count);
  const std::vector<ModePair> pairs = {{0, 0}, {0, 2}, {1, 1}};
  const Eigen::MatrixXd value = modal_derivatives(body, basis, pairs);
  const Eigen::SparseMatrix<double> mass = mass_matrix(body.mesh);
  const Eigen::VectorXd fold = basis.modes.col(0);
  for (int i = 0; i < 3; ++i) {
    Eigen::VectorXd load = second_force_derivative(body, basis.modes.col(pairs[i].first),
                                                   basis.modes.col(pairs[i].second));
    for (const int node : body.fixed_nodes) load.segment<3>(3 * node).setZero();
    load -= fold.dot(load) * (mass * fold);
    EXPECT_LT(imbalance(body, value.col(i), load).norm(), 1e-6 * load.norm()) << i;
    EXPECT_LT(std::abs(fold.dot(mass * value.col(i))),
              1e-10 * std::sqrt(value.col(i).dot(mass * value.col(i))));
  }
}

TEST(ModalDerivatives, CancelsAndRefusesNothingElse) {
  const ElasticBody body = some_body(Hold::kLeftFace);
  const ModalBasis basis = modes_of(body, 8);
  JobContext job;
  job.cancellation.request();
  EXPECT_THROW(static_cast<void>(modal_derivatives(body, basis, {{0, 0}}, job)), Error);
  EXPECT_EQ(0, modal_derivatives(body, basis, {}).cols());
}

}  // namespace
}  // namespace limber::bodies
