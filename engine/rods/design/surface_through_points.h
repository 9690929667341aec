#pragma once

#include <Eigen/Core>

#include "engine/rods/design/surface_mesh.h"

namespace limber::rods {

struct PointSurfaceOptions {
  /// Triangles with a longer side are left out, so that hollows of the rim and holes stay open
  /// [length]. A limit of 0 stands for four times the median of the triangles' longest sides; else
  /// > 0.
  double largest_gap = 0;
  /// Largest slope of triangles over the points' plane [rad], in (0, pi/2). If those of a tenth of
  /// the area are steeper, the points are not accepted as a height field.
  double steepest = 1.4;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// A surface inferred from points in no order: their Delaunay triangles over the plane that fits
/// them best. Vertices are the points. For surfaces that are no height field (closed, overhanging),
/// surface_through_joints knows the neighbours.
/// @param points  3 x n
/// @throws Error{kInvalidArgument}: points[i] where coordinates are not finite, or one lies over
/// another; points for fewer than three, for points on a line, and where they are no height field
[[nodiscard]] SurfaceMesh surface_through_points(const Eigen::Matrix3Xd& points,
                                                 const PointSurfaceOptions& options = {});

}  // namespace limber::rods
