#pragma once

#include "engine/scene/tetrahedralize/lattice.h"

namespace limber::scene::lattice {

/// Moves nodes towards the mean of their neighbours, surface nodes back onto the surface, and keeps
/// a move only if the worst tet around the node gets better: quality never falls. Nodes whose tets
/// are all better than `good_enough` (mean ratio) stay.
void smooth(Stuffing& stuffing, const ImplicitSolid& solid, double cell, int passes,
            const JobContext& job, double good_enough = 0.7);

}  // namespace limber::scene::lattice
