#pragma once

#include "engine/scene/tetrahedralize/lattice.h"

namespace limber::scene::lattice {

struct Repair {
  int nodes_separated = 0;  // copies made where parts touched in a node only
  int tets_dropped = 0;     // around edges where parts touched, and of smaller pieces
  int pieces_dropped = 0;
};

/// Makes a stuffing one solid piece. Tets around every node are connected through faces, and every
/// edge of the surface has two surface triangles. Only the largest piece (by volume) stays.
Repair make_one_piece(Stuffing& stuffing);

}  // namespace limber::scene::lattice
