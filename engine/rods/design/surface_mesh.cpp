#include "engine/rods/design/surface_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "engine/base/error.h"

namespace limber::rods {

Eigen::Matrix3d corners(const SurfaceMesh& mesh, Eigen::Index triangle) {
  Eigen::Matrix3d result;
  for (int k = 0; k < 3; ++k) result.col(k) = mesh.vertices.col(mesh.triangles(k, triangle));
  return result;
}

bool has_area(const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d ab = corners.col(1) - corners.col(0), ac = corners.col(2) - corners.col(0),
                        bc = corners.col(2) - corners.col(1);
  constexpr double kThin = 1e-13;  // height over the longest side; a normal needs a few digits
  return ab.cross(ac).norm() >
         kThin * std::max({ab.squaredNorm(), ac.squaredNorm(), bc.squaredNorm()});
}

void check_surface_mesh(const SurfaceMesh& mesh) {
  if (mesh.triangles.cols() == 0)
    throw Error(ErrorCode::kInvalidArgument, "surface.triangles", "the surface is empty");
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    if (mesh.vertices.col(v).allFinite()) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("surface.vertices[{}]", v),
                "coordinates must be finite");
  }
  bool any = false;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    for (const int vertex : mesh.triangles.col(t)) {
      if (vertex >= 0 && vertex < mesh.vertices.cols()) continue;
      throw Error(ErrorCode::kOutOfRange, fmt::format("surface.triangles[{}]", t),
                  fmt::format("vertex {} is outside 0 .. {}", vertex, mesh.vertices.cols() - 1));
    }
    any = any || has_area(corners(mesh, t));
  }
  if (!any) {
    throw Error(ErrorCode::kInvalidArgument, "surface.triangles",
                "none of the surface's triangles has an area");
  }
}

}  // namespace limber::rods
