#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/rods/design/placed_surface.h"
#include "engine/rods/design/surface_mesh.h"
#include "engine/rods/linkage/line_mesh.h"
#include "engine/rods/section/section.h"

namespace limber::rods {

struct StartingGridOptions {
  static constexpr int kMostJoints = 2500;  // columns times rows: beyond that it takes seconds

  int columns = 8;  // joints of each rod along the patch's longer sides, >= 3
  int rows = 8;     // and of those that cross them, >= 3
  /// At which rods cross when the grid lies flat, in [0.1, pi/2].
  double flat_angle = 0.8;  // [rad]
  /// Share of the patch that is left free at each side of its rim, in [0, 0.4].
  double margin = 0.02;
  /// Of the surface's heights over the plane nearest to it, what the flat drawing rises by, in [0,
  /// 1]: a grid that lies in its plane exactly opens to either side of it.
  double bulge = 0;
  /// How much wider cells are, at most, in the middle of rods, the more the nearer these are to the
  /// middle of the patch, in [0, 0.5]: so that the grid does not open in its plane, in which
  /// it lies a little less flat then. On surfaces that
  /// are saddles they are narrower there; the less the surface is curved, the more they are alike.
  /// Nothing: 0.4 where there is a bulge, whose side the grid is to open to, else 0.
  std::optional<double> widening = {};

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// A design to begin with where there is only a surface.
struct StartingGrid {
  LineMesh flat;      // in the plane z = 0, but for the bulge: opens as a linkage
  LineMesh deployed;  // the same lines on the surface: what it may deploy to
  /// Of the edges, in their order: lengths of the lines on the surface.
  Eigen::VectorXd rest_lengths;
  double mean_angle = 0;  // at which rods cross on the surface [rad]
  /// Largest difference between a flat edge and its rest length, as a share: what does not fit into
  /// the plane.
  double misfit = 0;
  /// How near neighbouring rods of a family lie to each other, at least, when the grid lies flat
  /// [length]: rods along which the column stays, and rods along which the row stays.
  double columns_apart = 0, rows_apart = 0;
};

/// A regular grid of rods over a patch: lines of its map to the square, joints where they cross
/// (joint (c, r) is vertex r * columns + c); and the grid laid flat at an angle, edges as long as
/// on the surface, rods as straight as that allows.
/// @throws Error as StartingGridOptions::validate and map_patch_to_square
[[nodiscard]] StartingGrid starting_grid(const SurfaceMesh& surface,
                                         const StartingGridOptions& options = {});

/// The same over the surface as it is placed. @throws Error as SurfacePlacement::validate, too
[[nodiscard]] StartingGrid starting_grid(SurfaceMesh surface, const SurfacePlacement& placement,
                                         const StartingGridOptions& options);

/// Rods that lie nearer to each other, flat, than they are thick are no grid, nor are threads: rods
/// 20 000 times as long as they are thick.
/// @throws Error as validate(section); {kInvalidArgument} with fields columns, rows, section
void demand_room(const StartingGrid& grid, const StartingGridOptions& options,
                 const Section& section);

}  // namespace limber::rods
