#pragma once

#include <Eigen/Core>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Columns X_1 - X_0, X_2 - X_0, X_3 - X_0 of a tet [m].
[[nodiscard]] Eigen::Matrix3d edge_matrix(const NodePositions& nodes, const Eigen::Vector4i& tet);

/// det of the edge matrix by a triple product: six times the signed volume [m^3]. The one place
/// that decides the orientation of a tet.
[[nodiscard]] double six_volumes(const Eigen::Matrix3d& edges);

/// Sum and largest of the six squared edge lengths [m^2].
struct SquaredEdges {
  double sum = 0, largest = 0;
};
[[nodiscard]] SquaredEdges squared_edges(const Eigen::Matrix3d& edges);

/// Mean ratio 12 (3 V)^(2/3) / (sum of squared edges) of a positive tet: 1 for the regular one, 0
/// for a flat one.
[[nodiscard]] double mean_ratio(const Eigen::Matrix3d& edges);

}  // namespace limber::bodies
