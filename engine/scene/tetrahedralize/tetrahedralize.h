#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
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
  double cell_size = 0;                 // > 0: used without a search; target_tets is ignored
  double count_tolerance = 0.1;         // relative; the search stops inside of it, in (0, 1)
  int smoothing_passes = 4;             // >= 0
  int max_lattice_points = 20'000'000;  // > 0; refused beyond: a thin body in a huge box
  /// Of surfaces: largest distance between the given surface and that of the tets, in either
  /// direction, as a share of the body's length (diagonal of its bounding box); in (0, 1]. 1 is no
  /// requirement.
  double within = 0.02;

  void validate() const;
};

/// Distance between the surface of a mesh and the original surface. Distances are from points to
/// triangles. Both surfaces are cut into smaller triangles where they might be farthest apart,
/// until the largest distance is bounded. It is never reported too small, and too large by at most
/// 1/50 of `within` (1e-4 to 4e-4 of the body's length). Distances below a tenth of `within` (0.001
/// to 0.01 of the length) may be reported as up to that. Points inside of overlapping parts do not
/// count.
struct SurfaceFit {
  double surface_to_mesh = 0;  // largest distance of the given surface from that of the mesh, and
  double mesh_to_surface = 0;  // back [length unit]
  double distance_share = 0;   // the larger one as a share of the body's length
  double surface_volume = 0;   // enclosed; overlaps of parts count for each [unit^3]
  double mesh_volume = 0;
  double share_beyond = 0;  // of the given vertices: farther than `within` from the mesh
  double within = 0;        // as requested
};

struct Tetrahedralization {
  bodies::TetMesh mesh;  // one piece, positively oriented, every node used
  MeshQuality quality;
  std::optional<SurfaceFit> fit;   // of surfaces only
  double cell_size = 0;            // side of the largest lattice cells, in the input's unit
  std::vector<std::string> notes;  // omitted parts, e.g. pieces too thin for the cell size
};

/// Isosurface stuffing (Labelle and Shewchuk 2007) with one cell size. In a body-centred cubic
/// lattice, points near the surface are moved onto it, and lattice tets are cut by it. Then
/// vertices shared by parts that touch only there are separated, the largest piece is kept, and
/// nodes are smoothed where that improves the worst tet around them. The cell size is searched so
/// that the number of tets is within the tolerance of the target. Parts thinner than about a cell
/// vanish.
/// @throws Error{kInvalidArgument} for bad options, a body that is empty or not bounded by its box;
/// {kNumerical} if
///   no cell size gives a mesh; {kLimitExceeded}; {kCancelled}
[[nodiscard]] Tetrahedralization tetrahedralize(const ImplicitSolid& solid,
                                                const TetrahedralizeOptions& options = {},
                                                const JobContext& job = {});

/// The same for the inside of a closed triangle surface (winding number above 1/2: overlapping
/// parts are united), kept within `options.within` of it. If one cell size exceeds this distance,
/// cells are split where it is too large (an octree's leaves, Labelle and Shewchuk 2007, section
/// 4). The number of tets is still about `target_tets`, so that cells elsewhere are larger. With
/// `cell_size` given, no cell is split: the distance is only measured and reported.
/// @throws Error{kLimitExceeded, "within"} if the number of tets does not suffice, with the
///   distance reached and a sufficient number; also as closed_outward of triangle_surface.h throws
[[nodiscard]] Tetrahedralization tetrahedralize(const TriangleSurface& surface,
                                                const TetrahedralizeOptions& options = {},
                                                const JobContext& job = {});

}  // namespace limber::scene
