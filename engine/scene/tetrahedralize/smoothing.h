#pragma once

#include "engine/scene/tetrahedralize/lattice.h"

namespace limber::scene::lattice {

/// Moves nodes towards the mean of their neighbours, and surface nodes back onto the surface. A
/// move is kept only if the worst tet around the node gets better: quality never falls. Nodes whose
/// tets are all better than `good_enough` (mean ratio) stay.
void smooth(Stuffing& stuffing, const ImplicitSolid& solid, double cell, int passes,
            const JobContext& job, double good_enough = 0.7);

/// The same where cells have several sizes; nodes of tets that stay out of shape are then moved in
/// many directions while that makes the worst tet around them better.
void smooth_graded(Stuffing& stuffing, const ImplicitSolid& solid, int passes,
                   const JobContext& job);

/// Newton along the gradient (central differences) onto the surface.
/// @param size  of tets there: sets tolerances and the longest move
/// @returns whether x came near enough to the surface
[[nodiscard]] bool project_to_surface(const ImplicitSolid& solid, double size, Eigen::Vector3d& x);

}  // namespace limber::scene::lattice
