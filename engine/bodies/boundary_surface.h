#pragma once

#include <Eigen/Core>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

using SurfaceTriangles = Eigen::Matrix<int, 3, Eigen::Dynamic>;  // 3 x t, node indices

/// Faces that belong to exactly one tet, counter-clockwise seen from outside, ordered by tet and
/// face.
/// @param tets  positively oriented; node indices may be of any size
[[nodiscard]] SurfaceTriangles boundary_surface(const TetNodes& tets);

}  // namespace limber::bodies
