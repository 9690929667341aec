#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "engine/base/error.h"

namespace limber::rods {

/// Straight edges between points, as read: a plain value without promises.
struct LineMesh {
  Eigen::Matrix3Xd vertices;  // 3 x n
  Eigen::Matrix2Xi edges;     // 2 x m, vertex indices from 0, from start to end
  /// 3 x n: of the surface that the lines lie on, of any length but 0; or 3 x 0: not given.
  Eigen::Matrix3Xd normals = {};

  [[nodiscard]] int vertex_count() const { return static_cast<int>(vertices.cols()); }
  [[nodiscard]] int edge_count() const { return static_cast<int>(edges.cols()); }
};

/// Why a line mesh is no embedded graph.
struct LineMeshFault {
  ErrorCode code = ErrorCode::kInvalidArgument;
  int vertex = -1, edge = -1;  // where; both -1: the whole
  std::string message;         // names vertices and edges by their numbers, from 0
  int normal = -1;             // or where a normal is wrong
};

/// The first fault, if any. These are kInvalidArgument: a coordinate that is not finite, no edges,
/// a self loop, a repeated edge, an edge without length. A normal that is zero or not finite is
/// kInvalidArgument too, as is a number of normals other than that of vertices. A vertex that does
/// not exist is kOutOfRange.
[[nodiscard]] std::optional<LineMeshFault> fault_of(const LineMesh& mesh);

/// @throws Error of fault_of, with field vertices[i], edges[e], edges, normals[i]
/// or normals
void check_line_mesh(const LineMesh& mesh);

}  // namespace limber::rods
