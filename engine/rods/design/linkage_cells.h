#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/design/surface_mesh.h"
#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// The cells between the rods of a linkage: joints around each, counter-clockwise about their
/// normals. Loops around the linkage and around its openings are none: their corners turn by less
/// than half a circle altogether, those of a cell by nearly a whole one. Ends of rods that lie
/// free bound nothing.
[[nodiscard]] std::vector<std::vector<int>> linkage_cells(const LinkageGraph& graph);

/// A surface inferred from the places of joints, e.g. of the targets of a design. It has a triangle
/// for each cell of three joints, a fan about the mean of its joints for each larger one. It may
/// close or overhang as the linkage does.
/// @param positions  3 x joints
/// @throws Error{kInvalidArgument} as check_surface_mesh, and with field surface.triangles for a
/// linkage without cells
[[nodiscard]] SurfaceMesh surface_through_joints(const LinkageGraph& graph,
                                                 const Eigen::Matrix3Xd& positions);

}  // namespace limber::rods
