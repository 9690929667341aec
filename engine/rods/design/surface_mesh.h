#pragma once

#include <Eigen/Core>

namespace limber::rods {

/// Triangles between points: a plain value without promises, as files hold it. Which side is which
/// does not matter to a target.
struct SurfaceMesh {
  Eigen::Matrix3Xd vertices;   // 3 x n [length]
  Eigen::Matrix3Xi triangles;  // 3 x t, vertex indices from 0
};

/// Refuses meshes that are no surface.
/// @throws Error with field surface.triangles: {kInvalidArgument} where there are none, or none has
/// an area; surface.vertices[i]: {kInvalidArgument} coordinates that are not finite;
/// surface.triangles[i]: {kOutOfRange} a vertex that is not there
void check_surface_mesh(const SurfaceMesh& mesh);

/// The corners of a triangle, one in each column.
[[nodiscard]] Eigen::Matrix3d corners(const SurfaceMesh& mesh, Eigen::Index triangle);

/// Does a triangle have a normal, or are its corners on a line up to rounding?
[[nodiscard]] bool has_area(const Eigen::Matrix3d& corners);

}  // namespace limber::rods
