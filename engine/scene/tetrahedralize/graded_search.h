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

/// Result of a search over lattices of graded cells.
struct GradedSearch {
  GradedMesh best;
  bool is_found = false;
  double nearest_share = 1;  // where not found: smallest distance seen with the requested tets
  int needed_tets = 0;       // where not found: a target that does; 0: more than `searched_tets`
  int searched_tets = 0;
};

/// Meshes of about `options.target_tets` tets that keep within `options.within`. The sides of large
/// cells are the body's length times fixed numbers. For each side, cells are split until the
/// surfaces are nowhere too far apart. The smallest side with at most the requested tets wins; the
/// remaining tets are used where the distance is largest.
[[nodiscard]] GradedSearch search_graded(const SurfaceBody& body,
                                         const TetrahedralizeOptions& options, double uniform_cell,
                                         const JobContext& job);

}  // namespace limber::scene::lattice
