#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace limber::scene {

/// A triangle mesh as read: a plain value. Corners counter-clockwise seen from outside.
struct TriangleSurface {
  Eigen::Matrix3Xd vertices;                        // 3 x n
  Eigen::Matrix<int, 3, Eigen::Dynamic> triangles;  // 3 x t, vertex indices from 0
  std::vector<std::string> warnings;  // of the reader: merged vertices, split polygons

  [[nodiscard]] int vertex_count() const { return static_cast<int>(vertices.cols()); }
  [[nodiscard]] int triangle_count() const { return static_cast<int>(triangles.cols()); }
};

/// Properties of a surface as the boundary of a solid.
struct SurfaceCheck {
  int open_edges = 0;                 // edges of one triangle only
  int crowded_edges = 0;              // edges of three or more triangles
  int flipped_edges = 0;              // edges whose two triangles are oriented against each other
  int degenerate_triangles = 0;       // with a repeated vertex or no area
  int first_open_edge[2] = {-1, -1};  // its vertices
  int first_crowded_edge[2] = {-1, -1};
  int first_flipped_edge[2] = {-1, -1};
  double volume = 0;  // enclosed, positive if oriented outward

  [[nodiscard]] bool closed_manifold() const { return open_edges == 0 && crowded_edges == 0; }
  [[nodiscard]] bool oriented() const { return flipped_edges == 0; }
};

[[nodiscard]] SurfaceCheck check_surface(const TriangleSurface& surface);

/// Refuses surfaces that do not enclose a volume: open, crowded or inconsistently oriented edges,
/// indices out of range, NaN. A surface that is consistently oriented inward is turned over.
/// @throws Error{kInvalidArgument} naming the kind of fault, how many there are, and the first edge
[[nodiscard]] TriangleSurface closed_outward(const TriangleSurface& surface);

}  // namespace limber::scene
