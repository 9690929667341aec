#pragma once

#include <Eigen/Core>

#include "engine/rods/design/target_surface.h"

namespace limber::rods {

/// The point of a triangle that is closest to a point in space. It is found by the region of space
/// (of a face, three edges, three vertices) that the point is in (Ericson, Real-Time Collision
/// Detection, 2005, sec. 5.1.5). Regions are closed: where two meet, a vertex comes before an edge,
/// an edge before the face.
/// @param corners  in columns, with an area
[[nodiscard]] ClosestPoint project_onto_triangle(const Eigen::Matrix3d& corners,
                                                 const Eigen::Vector3d& point);

}  // namespace limber::rods
