#pragma once

#include <Eigen/Core>

namespace limber::rods {

/// Straight edges between points, as read: a plain value without promises.
struct LineMesh {
  Eigen::Matrix3Xd vertices;  // 3 x n
  Eigen::Matrix2Xi edges;     // 2 x m, vertex indices from 0, from start to end

  [[nodiscard]] int vertex_count() const { return static_cast<int>(vertices.cols()); }
  [[nodiscard]] int edge_count() const { return static_cast<int>(edges.cols()); }
};

/// Refuses what is no embedded graph.
/// @throws Error{kInvalidArgument} with field vertices[i] or edges[e]: a coordinate that is not
/// finite, no edges, a self loop, a repeated edge, an edge without length; {kOutOfRange} for a
/// vertex that is not there
void check_line_mesh(const LineMesh& mesh);

}  // namespace limber::rods
