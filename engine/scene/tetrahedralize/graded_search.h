#pragma once

#include "engine/scene/tetrahedralize/lattice.h"
#include "engine/scene/tetrahedralize/repair.h"
#include "engine/scene/tetrahedralize/surface_fit.h"

namespace limber::scene::lattice {

/// A body bounded by triangles.
struct SurfaceBody {
  const TriangleSurface& surface;  // closed, oriented outward
  const TriangleTree& tree;        // of it
  const ImplicitSolid& solid;      // of the tree
};

struct GradedMesh {
  Stuffing stuffing;
  Repair repair;
  double cell_size = 0;  // of cells that are not split
  SurfaceFit fit;
};

/// What a search over lattices of graded cells came to.
struct GradedSearch {
  GradedMesh best;
  bool is_found = false;
  double nearest_share = 1;  // where not found: smallest distance seen with the requested tets
  int needed_tets = 0;       // where not found: a target that does; 0: more than `searched_tets`
  int searched_tets = 0;
};

/// Meshes of about `options.target_tets` tets that keep within `options.within`. For sides of large
/// cells that are the body's length times fixed numbers, cells are split where the surfaces are too
/// far apart, until they are not; the smallest side with at most the requested tets wins, and what
/// is left of these is spent where the distance is largest.
[[nodiscard]] GradedSearch search_graded(const SurfaceBody& body,
                                         const TetrahedralizeOptions& options, double uniform_cell,
                                         const JobContext& job);

}  // namespace limber::scene::lattice
