#pragma once

#include <Eigen/Core>

#include "engine/rods/design/surface_mesh.h"

namespace limber::rods {

/// Maps a patch of surface one to one onto the unit square: mean value coordinates (Floater 2003)
/// inside, the rim by its length between four corners (patch_corners). The square's first direction
/// is that of the patch's longer sides, going forward along the axis it is nearest to; the second
/// one is where the normal goes forward, too. Between equal sides, the first is the one more along
/// x; if both are as much along x and y, the one that goes forward along both.
///
/// Here the surface must be one piece, each edge of one or two triangles, with one rim and no
/// handle: what a square can be mapped to.
/// @returns 2 x vertices, in [0, 1]; vertices that no triangle uses are left at 0
/// @throws Error as check_surface_mesh; {kInvalidArgument} with field surface.triangles where the
/// surface is no such patch, and with triangles[t] for one without area
[[nodiscard]] Eigen::Matrix2Xd map_patch_to_square(const SurfaceMesh& surface);

}  // namespace limber::rods
