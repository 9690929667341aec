#pragma once

#include <Eigen/Core>

#include "engine/rods/design/grid_lines.h"

namespace limber::rods {

/// Gaussian curvature of a surface at the joints of a grid over it, as a sum of parts along columns
/// and along rows. K(c, r) is about mean + columns[c] + rows[r] [1/length^2].
struct GridCurvature {
  double mean = 0;
  Eigen::VectorXd columns, rows;  // those at the rim as their neighbours
  /// Share of it that is twist along the grid's lines, 0 .. 1: 1 where these are straight, as on z
  /// = x y.
  double twist = 0;

  [[nodiscard]] bool vanishes() const { return mean == 0 && columns.isZero(0) && rows.isZero(0); }
};

/// From central differences of the joints' places: det(II) / det(I), weighed by the area there.
/// @param points  3 x joints, on the surface
/// @pre three columns and rows at least
[[nodiscard]] GridCurvature grid_curvature(const GridLines& grid, const Eigen::Matrix3Xd& points);

}  // namespace limber::rods
