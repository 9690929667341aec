#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/scene/tetrahedralize/mesh_quality.h"
#include "engine/scene/triangle_surface.h"

namespace limber::scene {

/// A body given by a function that is negative inside and positive outside, like a signed distance.
struct ImplicitSolid {
  std::function<double(const Eigen::Vector3d&)> distance;
  Eigen::AlignedBox3d bounds;  // the whole body lies in it
  /// |f(x) - f(y)| <= lipschitz |x - y|; lets most of space be skipped. 1 for a true distance.
  double lipschitz = 1;
};

struct TetrahedralizeOptions {
  int target_tets = 5000;               // >= 50, <= 5,000,000
  double cell_size = 0;                 // > 0: use this one and search none; target_tets is ignored
  double count_tolerance = 0.1;         // relative; the search stops inside of it, in (0, 1)
  int smoothing_passes = 4;             // >= 0
  int max_lattice_points = 20'000'000;  // > 0; refused beyond: a thin body in a huge box

  void validate() const;
};

struct Tetrahedralization {
  bodies::TetMesh mesh;  // one piece, positively oriented, every node used
  MeshQuality quality;
  double cell_size = 0;            // side of a lattice cell, in the input's unit
  std::vector<std::string> notes;  // what was left out, e.g. pieces too thin for the cell size
};

/// Isosurface stuffing (Labelle and Shewchuk 2007) with one cell size: a body-centred cubic
/// lattice, points near the surface moved onto it, lattice tets cut by it; then vertices shared by
/// parts that touch only there are separated, the largest piece is kept, and nodes are smoothed
/// where that improves the worst tet around them. The cell size is searched so that the number of
/// tets is within the tolerance of the target. Parts thinner than about a cell vanish.
/// @throws Error{kInvalidArgument} for bad options, a body that is empty or not bounded by its box;
/// {kNumerical} if
///   no cell size gives a mesh; {kLimitExceeded}; {kCancelled}
[[nodiscard]] Tetrahedralization tetrahedralize(const ImplicitSolid& solid,
                                                const TetrahedralizeOptions& options = {},
                                                const JobContext& job = {});

/// The same for the inside of a closed triangle surface (winding number above 1/2: overlapping
/// parts are united).
/// @throws Error also as closed_outward of triangle_surface.h throws
[[nodiscard]] Tetrahedralization tetrahedralize(const TriangleSurface& surface,
                                                const TetrahedralizeOptions& options = {},
                                                const JobContext& job = {});

}  // namespace limber::scene
