#pragma once

#include <Eigen/Core>

namespace limber::reduced {

/// Meaning of a field's length.
enum class FieldScaling {
  kUnit,     // none: all count the same
  kAsGiven,  // how much it counts
};

/// Basis of the poses `u` (3n x S) by mass-weighted proper orthogonal decomposition. Each pose has
/// unit norm so that relative errors count (or its given norm). The basis has at most `size`
/// columns, orthonormal in the plain inner product and nested (the first h columns are the basis of
/// size h). Fewer if the poses span less (directions below 1e-7 of the largest), never more than
/// rows.
/// @param node_mass  n, positive weights of the nodes
/// @param exact      3n x k, k may be 0: fields that the first k columns span exactly (translations
/// of a free body)
[[nodiscard]] Eigen::MatrixXd snapshot_basis(const Eigen::Ref<const Eigen::MatrixXd>& u,
                                             const Eigen::VectorXd& node_mass,
                                             const Eigen::Ref<const Eigen::MatrixXd>& exact,
                                             int size, FieldScaling scaling = FieldScaling::kUnit);

}  // namespace limber::reduced
