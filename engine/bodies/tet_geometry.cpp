#include "engine/bodies/tet_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace limber::bodies {

Eigen::Matrix3d edge_matrix(const NodePositions& nodes, const Eigen::Vector4i& tet) {
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = nodes.col(tet[a + 1]) - nodes.col(tet[0]);
  return edges;
}

double six_volumes(const Eigen::Matrix3d& edges) {
  return edges.col(0).cross(edges.col(1)).dot(edges.col(2));
}

SquaredEdges squared_edges(const Eigen::Matrix3d& edges) {
  SquaredEdges result;
  const auto count = [&](double squared) {
    result.sum += squared;
    result.largest = std::max(result.largest, squared);
  };
  for (int a = 0; a < 3; ++a) {
    count(edges.col(a).squaredNorm());
    count((edges.col(a) - edges.col((a + 1) % 3)).squaredNorm());
  }
  return result;
}

double mean_ratio(const Eigen::Matrix3d& edges) {
  const double root = std::cbrt(six_volumes(edges) / 2);
  return 12 * root * root / squared_edges(edges).sum;
}

}  // namespace limber::bodies
