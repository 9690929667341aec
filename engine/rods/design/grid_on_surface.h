#pragma once

#include <Eigen/Core>

#include "engine/rods/design/grid_lines.h"
#include "engine/rods/design/patch_lift.h"
#include "engine/rods/design/straight_layout.h"

namespace limber::rods {

/// A regular grid over a patch: lines of its map to the square.
struct GridOnSurface {
  /// @param margin  share of the square that is left free at each side
  GridOnSurface(const PatchLift& lift, int columns, int rows, double margin);

  GridLines lines;
  Eigen::Matrix3Xd points;  // joints [length]
  Eigen::VectorXd lengths;  // of lines.edges, along the surface [length]
};

/// Straight rods as long as the lines in the mean, which grow along the others as these do. They
/// fit the surface's curvature, or at least one that makes up for about half of its height.
[[nodiscard]] StraightLayout layout_of(const GridOnSurface& grid, double flat_angle);

/// Heights of the joints over the plane nearest to them, 0 in the mean [length], to the side about
/// which columns' rods lie counter-clockwise from rows'.
[[nodiscard]] Eigen::VectorXd heights_of(const GridOnSurface& grid);

/// Root mean square height of points over the plane nearest to them [length].
[[nodiscard]] double height_of(const Eigen::Matrix3Xd& points);

/// The same as far as a mean Gaussian curvature makes up for it: not what curves in one direction
/// only, nor to both sides by turns.
[[nodiscard]] double curved_height(const Eigen::Matrix3Xd& points, double mean_curvature);

}  // namespace limber::rods
