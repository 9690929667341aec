#pragma once

#include <Eigen/Core>

#include "engine/rods/design/grid_curvature.h"
#include "engine/rods/design/grid_lines.h"

namespace limber::rods {

/// Input of a layout: the shape for which two families of straight rods in the plane are drawn.
///
/// Opened in its plane, a grid of parallel rods stays flat. A grid whose rods change their
/// directions from neighbour to neighbour does not. Its lengths fit the plane at one angle but not
/// at another, and rods that are stiff sideways leave it for a surface on which they are straight.
/// To first order in how lengths and angles vary, with lengths 1 + a along rows (u) and 1 + b along
/// columns (v), straight at the angle alpha_0 means
///
///   b_u = f(v) + cos(alpha_0) a_v,  a_v = g(u) + cos(alpha_0) b_u,
///
/// angles that change by -g / sin(alpha_0) with u and by -f / sin(alpha_0) with v, and, opened to
/// alpha_1, where the two families bend as little as they can,
///
///   K = -(cos(alpha_0) - cos(alpha_1)) (f' + g') / (2 sin^2(alpha_0) sin^2(alpha_1))
///
/// (from K = -(a_vv - F_uv + b_uu) / sin^2(alpha), F = cos(alpha) (a + b) - sin(alpha) theta). The
/// directions of columns' rods are therefore the second integral of K's share along columns, and
/// those of rows' rods of the share along rows.
struct StraightLayout {
  /// Places along rows, ascending, 0 in the middle [length]: so far columns lie apart in the mean
  /// of all rows.
  Eigen::VectorXd columns;
  Eigen::VectorXd rows;     // and places along columns, of rows
  double flat_angle = 0;    // alpha_0, in the mean of all joints [rad]
  double open_angle = 0;    // alpha_1, above it, but for parallel rods [rad]
  GridCurvature curvature;  // K
  /// How edges along rows grow with v, and those along columns with u, as shares [1/length]: of
  /// patches whose sides are not parallel.
  double rows_widen = 0, columns_widen = 0;
};

/// Joints where the rods cross, 3 x joints in the plane z = 0.
[[nodiscard]] Eigen::Matrix3Xd draw(const GridLines& grid, const StraightLayout& layout);

/// Keeps this share of the widening of rows and columns, and of the curvature; without both, rods
/// of a family are parallel.
void fan_less(StraightLayout& layout, double share);
void curve_less(StraightLayout& layout, double share);

/// Do rods cross at the least angle or more, from either side, and are edges not much shorter than
/// others of their row or column? Rods that change their directions too much cross each other.
[[nodiscard]] bool is_regular(const GridLines& grid, const Eigen::Matrix3Xd& points,
                              double least_angle);

}  // namespace limber::rods
