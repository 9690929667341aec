#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/tet_mesh.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "engine/scene/tetrahedralize/triangle_tree.h"

namespace limber::scene::lattice {

/// A place where two surfaces are apart.
struct Gap {
  Eigen::Vector3d at;
  double distance = 0;  // to the other surface
};

struct OneSidedDistance {
  double largest = 0;     // found on the triangles
  double bound = 0;       // no point of them is farther away
  std::vector<Gap> gaps;  // farther than requested, about `spacing` apart
};

struct GapSearch {
  double threshold = 0;   // gaps beyond this distance are collected; infinity: none
  double spacing = 0;     // triangles are cut this small around gaps
  double resolution = 0;  // the largest distance is bounded this well [length unit], > 0,
  double ignored = 0;     // or by this and the resolution, where it is smaller
};

/// Distance from the triangles of `from` to the surface of `to`, measured from points to triangles:
/// triangles are cut into smaller ones if they might be farther away than the largest known
/// distance. (The distance of a point changes no faster than the point.) Points of `from` inside of
/// the body that `from_tree` bounds (parts that overlap) do not count; null: all count.
[[nodiscard]] OneSidedDistance one_sided_distance(const TriangleSurface& from,
                                                  const TriangleTree* from_tree,
                                                  const TriangleTree& to, const GapSearch& search,
                                                  const JobContext& job);

/// Comparison of a mesh with the surface that it was made from.
struct FitMeasurement {
  SurfaceFit fit;
  std::vector<Gap> gaps;  // of both surfaces, farther than the threshold
};

/// @param threshold  gaps beyond this distance are collected [length unit]; infinity: none
[[nodiscard]] FitMeasurement measure_fit(const TriangleSurface& surface, const TriangleTree& tree,
                                         const bodies::TetMesh& mesh, double within,
                                         double threshold, const JobContext& job);

/// Whether a part of the surface is more than `distance` away from the largest part (by volume) and
/// from all parts connected with that. Parts whose boxes overlap count as connected.
[[nodiscard]] bool has_far_part(const TriangleSurface& surface, double distance);

/// The boundary of a mesh, with its own vertices only.
[[nodiscard]] TriangleSurface boundary_of(const bodies::TetMesh& mesh);

}  // namespace limber::scene::lattice
