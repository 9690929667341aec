#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "engine/base/degrees.h"
#include "engine/rods/design/grid_on_surface.h"
#include "engine/rods/design/placed_surface.h"
#include "engine/rods/design/surface_mesh.h"
#include "engine/rods/linkage/line_mesh.h"
#include "engine/rods/section/section.h"

namespace limber::rods {

struct StartingGridOptions {
  static constexpr int kMaxJoints = 2500;  // columns times rows: beyond that it takes seconds

  int columns = 8;  // joints of each rod along the patch's longer sides, >= 3
  int rows = 8;     // and of those that cross them, >= 3
  /// At which rods cross when the grid lies flat, in the mean, in [0.1, pi/2].
  double flat_angle = 25 * kDegree;  // [rad]
  /// Share of the patch that is left free at each side of its rim, in [0, 0.4].
  double margin = 0.02;
  /// Multiple of the surface's mean Gaussian curvature for which the layout is drawn, in [0, 1000].
  /// Rods resist, so that the opened grid has less. With 0, the rods of a family are parallel and
  /// stay in their plane. If empty, the drive that a section needs; 3 without a section, or if no
  /// drive opens it.
  std::optional<double> drive = {};
  std::optional<Section> section = {};  // of the rods

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// A design to begin with where there is only a surface.
struct StartingGrid {
  LineMesh flat;      // in the plane z = 0: opens as a linkage, which leaves that plane
  LineMesh deployed;  // lines on the surface: about its opened shape
  /// For the flat edges, in their order: with these lengths the linkage lies flat without stress.
  Eigen::VectorXd rest_lengths;
  double mean_angle = 0;  // at which rods cross on the surface [rad]
  /// Largest difference between a rest length and the line on the surface, as a share.
  double misfit = 0;
  /// Least distance between neighbouring rods of a family when the grid lies flat [length]. First
  /// of rods along which the column stays, then of rods along which the row stays.
  double columns_apart = 0, rows_apart = 0;
  /// The flat grid may open to either side of its plane. With these forces along z at its joints,
  /// over Young's modulus [length^2], it opens to the surface's side; they are of the order of what
  /// bends rods noticeably. Empty without a section.
  Eigen::VectorXd push = {};
  std::string remark = {};  // obstacles to a design; empty: none
};

/// Two families of straight rods in the plane (StraightLayout; joint (c, r) is vertex r * columns +
/// c), with a regular grid over a patch. The rods are as long as the grid's lines are in the mean.
/// The layout is free of stress as it lies. Opened to the angle at which lines cross on the
/// surface, it curves as the surface does in the mean, along columns and along rows.
/// @throws Error as StartingGridOptions::validate and map_patch_to_square; with a section as
/// demand_room. Also {kInvalidArgument} with field flat_angle if that leaves nothing to open, and
/// with field section if a grid of such rods stays in its plane
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
