#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "engine/bodies/dof_map.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/bodies/stiffness.h"

namespace limber::bodies::testing {

inline ModalBasis modes_of(const ElasticBody& body, int count) {
  ModalOptions options;
  options.mode_count = count;
  return modal_analysis(body, options);
}

inline DofMap free_dofs(const ElasticBody& body) {
  return DofMap::of_vectors(body.mesh.node_count(), body.fixed_nodes);
}

inline Eigen::SparseMatrix<double> free_stiffness(const ElasticBody& body) {
  return free_dofs(body).restrict_matrix(stiffness_matrix(body.mesh));
}

inline Eigen::SparseMatrix<double> free_mass(const ElasticBody& body) {
  return free_dofs(body).restrict_matrix(mass_matrix(body.mesh));
}

/// max over the elastic pairs of |K phi - lambda M phi| / (lambda |M phi|).
inline double worst_relative_residual(const ElasticBody& body, const ModalBasis& basis) {
  const Eigen::SparseMatrix<double> stiffness = free_stiffness(body), mass = free_mass(body);
  const Eigen::MatrixXd modes = free_dofs(body).restrict_rows(basis.modes);
  double worst = 0;
  for (Eigen::Index k = basis.rigid_count; k < modes.cols(); ++k) {
    const Eigen::VectorXd inertia = basis.eigenvalues[k] * (mass * modes.col(k));
    worst = std::max(worst, (stiffness * modes.col(k) - inertia).norm() / inertia.norm());
  }
  return worst;
}

/// The same in the norm of energy, sqrt(sum r_i^2 / K_ii) / sqrt(lambda).
inline double worst_energy_residual(const ElasticBody& body, const ModalBasis& basis) {
  const Eigen::SparseMatrix<double> stiffness = free_stiffness(body), mass = free_mass(body);
  const Eigen::MatrixXd modes = free_dofs(body).restrict_rows(basis.modes);
  const Eigen::VectorXd weight = stiffness.diagonal().cwiseSqrt().cwiseInverse();
  double worst = 0;
  for (Eigen::Index k = basis.rigid_count; k < modes.cols(); ++k) {
    const double lambda = basis.eigenvalues[k];
    const Eigen::VectorXd residual = stiffness * modes.col(k) - lambda * (mass * modes.col(k));
    worst = std::max(worst, residual.cwiseProduct(weight).norm() / std::sqrt(lambda));
  }
  return worst;
}

inline void expect_orthonormal(const ElasticBody& body, const ModalBasis& basis) {
  const Eigen::Index count = basis.modes.cols();
  ASSERT_TRUE(basis.modes.allFinite());
  const Eigen::MatrixXd gram = basis.modes.transpose() * (mass_matrix(body.mesh) * basis.modes);
  EXPECT_LT((gram - Eigen::MatrixXd::Identity(count, count)).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_TRUE(std::is_sorted(basis.eigenvalues.begin(), basis.eigenvalues.end()));
  for (const int node : body.fixed_nodes) {
    EXPECT_EQ(basis.modes.middleRows<3>(3 * node).cwiseAbs().maxCoeff(), 0);
  }
}

}  // namespace limber::bodies::testing
