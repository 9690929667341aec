#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "engine/bodies/elastic_body.h"

namespace limber::bodies {

/// n, per node a quarter of the mass of its tets [kg]. Acts alike on the three axes.
[[nodiscard]] Eigen::VectorXd lumped_node_mass(const TetMesh& mesh);

/// n x n (full): integral of rho N_a N_b, per tet rho V / 20 (1 + delta_ab) [kg]. Acts alike on the
/// three axes. Exact for every motion that is linear over each tet; in particular it gives a rigid
/// body's true inertia.
[[nodiscard]] Eigen::SparseMatrix<double> consistent_node_mass(const TetMesh& mesh);

/// M, 3n x 3n (full), ordered 3 * node + axis: consistent_node_mass on each axis. The mass of modal
/// analysis.
[[nodiscard]] Eigen::SparseMatrix<double> mass_matrix(const TetMesh& mesh);

}  // namespace limber::bodies
