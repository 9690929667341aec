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

/// Straight rods as long as the lines are in the mean, and as these grow along the others; for the
/// surface's curvature.
[[nodiscard]] StraightLayout layout_of(const GridOnSurface& grid, double flat_angle);

/// The joint to hold a grid by, its motion, so that a weight on it says to which side it opens.
struct GridHold {
  int joint = 0;
  /// How far the surface's tangent plane there lies over the mean joint [length], on the side about
  /// which columns' rods lie counter-clockwise from rows'.
  double rise = 0;
};

/// The middle one, unless that is much more of others in the middle row and column, as at the ends
/// of saddles.
[[nodiscard]] GridHold hold_of(const GridOnSurface& grid);

/// Root mean square height of points over the plane nearest to them, as far as a mean Gaussian
/// curvature makes up for it: not what curves in one direction only, nor to both sides by turns
/// [length].
[[nodiscard]] double curved_height(const Eigen::Matrix3Xd& points, double mean_curvature);

}  // namespace limber::rods
