#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Stiffness of one linear tet, 12 x 12, ordered 3 * corner + axis [N/m].
///
/// Energy V (lambda/2 tr(eps)^2 + mu eps : eps), eps = (H + H^T)/2. Block (a, b) is V (lambda g_a
/// g_b^T + mu g_b g_a^T + mu (g_a . g_b) I) with g_a the shape gradients.
/// @param shape_gradients  3 x 4 [1/m]
/// @param volume           [m^3]
[[nodiscard]] Eigen::Matrix<double, 12, 12> tet_stiffness(
    const Eigen::Ref<const Eigen::Matrix<double, 3, 4>>& shape_gradients, double volume,
    const Material& material);

/// K of linear isotropic elasticity at rest, 3n x 3n (full, symmetric), ordered 3 * node + axis
/// [N/m]. Materials are per tet. Rigid modes are in its kernel.
[[nodiscard]] Eigen::SparseMatrix<double> stiffness_matrix(const TetMesh& mesh,
                                                           const GradientOperator& gradient);
[[nodiscard]] Eigen::SparseMatrix<double> stiffness_matrix(const TetMesh& mesh);

/// u^T K u / 2 [J], summed tet by tet from differences of displacements: where stiff parts move
/// almost rigidly this keeps digits that K u loses to cancellation.
/// @param u  3n [m]
[[nodiscard]] double strain_energy(const TetMesh& mesh, const GradientOperator& gradient,
                                   const Eigen::Ref<const Eigen::VectorXd>& u);

/// K u, 3n [N], tet by tet from differences of displacements: keeps digits as strain_energy() does.
/// @param u  3n [m]
[[nodiscard]] Eigen::VectorXd elastic_forces(const TetMesh& mesh, const GradientOperator& gradient,
                                             const Eigen::Ref<const Eigen::VectorXd>& u);

}  // namespace limber::bodies
