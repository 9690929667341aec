#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "engine/rods/design/surface_mesh.h"

namespace limber::rods {

/// Does a direction point backward along the axis that it is nearest to, the first of those as
/// near?
[[nodiscard]] bool points_backward(const Eigen::Vector3d& direction);

/// The four vertices of a patch's rim that are farthest along the diagonals of the patch's
/// principal axes, up to rounding independent of the order of vertices. Axes that are turned count
/// where their corners enclose clearly more; where principal axes are arbitrary, as those of
/// squares are, axes along x are the first. A rim that is far out in fewer directions, as a
/// triangle's is, is cut into quarters from the vertex farthest out.
/// @param rim  vertices going round once, in either direction
/// @returns places in the rim, ascending
/// @throws Error{kInvalidArgument} with field surface.triangles for a rim of three vertices
[[nodiscard]] std::array<std::size_t, 4> patch_corners(const SurfaceMesh& surface,
                                                       const std::vector<int>& rim);

}  // namespace limber::rods
