#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/bodies/tet_mesh.h"
#include "engine/scene/detailed_surface.h"
#include "engine/scene/issue.h"
#include "engine/scene/simulation.h"

namespace limber::scene {

enum class End {
  kFree,
  kPinnedPosition,
  kPinnedPositionVelocity,
  kCyclic,  // of both ends or of none: the last frame leads into the first, as if N frames before
};
enum class Cubature { kFittedMaps, kWeights };
/// Source of the columns that span the body's shapes.
enum class Basis { kBest, kSnapshots, kModalDerivatives, kMapDerivatives };
enum class TargetKind {
  kDisplacement,  // relative to the rest position
  kPosition,      // a point in the mesh's space
  kVelocity,      // of the shown frames, see velocity_span()
};

/// How modes go from frame to frame.
enum class Discretisation {
  kSampled,      // free motion is exact at the frames; forces cost the same at any frame rate
  kDifferences,  // published: differences with the frame as their step
};

/// How fast and how lively the body moves.
struct Dynamics {
  double frames_per_second = 30;  // > 0
  double period_frames =
      40;  // frames of one swing of the lowest elastic mode; 0: from materials and fps
  /// Of critical, in [0, 1): of the lowest elastic mode. Damping grows with stiffness, as in a body
  /// of viscous material, so that faster modes are damped more in proportion to their frequency.
  /// With published differences it is that of every mode.
  double damping_ratio = kCalmDamping;
  Discretisation discretisation = Discretisation::kSampled;
  double force_smoothing = kCalmSmoothing;  // [s], >= 0: about the time in which forces change
  /// Of the body under its base motion, in [0, kGreatestInertia]: 1 lags behind as a body would, 0
  /// follows. Of sampled modes.
  double inertia = 0;

  /// Defaults of sampled modes. With them, keys of a tenth to a third of the body's length neither
  /// shake the body nor swing it to the other side. Two equal keys hold it between them
  /// (limber-bench calm).
  static constexpr double kCalmDamping = 0.7, kCalmSmoothing = 0.5;
  static constexpr double kGreatestInertia = 10;
};

/// Dynamics of which some may be left to their defaults. Published differences have neither damping
/// nor smoothing by default.
struct DynamicsRequest {
  double frames_per_second = 30;
  double period_frames = 40;
  std::optional<double> damping_ratio = std::nullopt;
  std::optional<Discretisation> discretisation = std::nullopt;
  std::optional<double> force_smoothing = std::nullopt;
  std::optional<double> inertia = std::nullopt;

  /// @param where_absent  the discretisation where none is requested
  [[nodiscard]] Dynamics resolved(Discretisation where_absent) const {
    const Discretisation chosen = discretisation.value_or(where_absent);
    const bool is_calm = chosen == Discretisation::kSampled;
    return {frames_per_second,
            period_frames,
            damping_ratio.value_or(is_calm ? Dynamics::kCalmDamping : 0),
            chosen,
            force_smoothing.value_or(is_calm ? Dynamics::kCalmSmoothing : 0),
            inertia.value_or(0)};
  }
};

/// Sizes of 0 are chosen so that the mean relative error on held-out poses is below the tolerance.
struct ModelRequest {
  /// r, > 0. kDefaultModes are as many as a smaller mesh has; any other number must be below the
  /// mesh's elastic degrees of freedom.
  int mode_count = kDefaultModes;
  /// Whether the scene names r, or sessions may choose it; other numbers than kDefaultModes are
  /// named in any case.
  enum class ModesBy { kSession, kScene };
  ModesBy modes_by = ModesBy::kSession;
  double tolerance = 0.01;
  int basis_size = 0;
  int cubature_size = 0;
  Cubature cubature = Cubature::kFittedMaps;
  Basis basis = Basis::kBest;
  /// R, modes that material optimisation may mix, >= mode_count; 0: kDefaultCandidates where a
  /// scene is opened with MaterialVariables::kAll (or as many as the mesh has), else mode_count.
  int candidate_modes = 0;

  [[nodiscard]] bool names_modes() const {
    return modes_by == ModesBy::kScene || mode_count != kDefaultModes;
  }

  static constexpr int kDefaultModes = 30;
  static constexpr int kDefaultCandidates = 80;  // as in the paper's table 1
};

/// Variables that are optimised in addition to the control forces (paper: space-time editing,
/// section 4).
enum class MaterialVariables {
  kMotion,    // none: the material does not change
  kDynamics,  // frequencies and damping of the modes
  kAll,       // and the modes themselves, as mixtures of more of them
};

struct MaterialOptimisation {
  MaterialVariables variables = MaterialVariables::kMotion;
  double column_weight = 1;  // mu >= 0: keeps mixed modes near unit size
  /// Bound for fitted modes [Hz], in (0, half the frames per second]; empty: an eighth of the
  /// frames per second of the scene.
  std::optional<double> max_frequency_hz;
  int slow_steps = 10;  // of a fit from the scene's own material, in [0, kMaxSlowSteps]

  static constexpr int kMaxSlowSteps = 1000;
};

/// Whose triangles a SurfacePoint counts.
enum class PointSurface {
  kShown,    // the carried surface where the scene has one, else the mesh's boundary
  kMesh,     // the boundary of the mesh, see scene::mesh_surface()
  kCarried,  // Scene::surface
};

/// A point of a triangle: the mean of its corners with these weights.
struct SurfacePoint {
  int triangle = 0;
  Eigen::Vector3d weights = {1, 0, 0};  // >= 0, their sum 1 to 1e-6; divided by it
  PointSurface surface = PointSurface::kShown;
};

/// A further point of a path.
struct PathKey {
  int frame = 0;                       // later than that of the key before
  Eigen::Vector3d target = {0, 0, 0};  // in the kind and unit of the constraint's
};

/// A target in one frame for the (mean) position of nodes, or for their (mean) velocity. Instead of
/// nodes, it may be that of a point of the shown surface.
struct Constraint {
  std::uint64_t id = 0;  // 0: to be numbered by the session
  int frame = 0;
  /// Source node ids, one or more; a group is held by its mean. One of nodes, point and
  /// surface_vertex is given.
  std::vector<int> nodes;
  unsigned axes = 7;  // bit 0: x, 1: y, 2: z
  TargetKind kind = TargetKind::kDisplacement;
  Eigen::Vector3d target = {0, 0, 0};  // [scene length unit], of a velocity [scene length unit / s]
  /// gamma, > 0, of gamma/2 |miss / body length|^2, of a velocity gamma/2 |miss 1 s / body
  /// length|^2; infinity holds exactly
  double weight = 100;
  std::optional<SurfacePoint> point;
  std::optional<int> surface_vertex;  // of Scene::surface
  /// Not empty: held in every frame from `frame`, there at `target`, to that of the last key
  /// (target_in()). Not of velocities.
  std::vector<PathKey> path = {};
  /// How far the path begins and ends at rest, in [0, 1]: with 0 at the speed of its first and last
  /// piece.
  double ease_in = 1, ease_out = 1;
  /// [s], > 0: frames farther from its own have the motion without it; absent: it acts everywhere.
  std::optional<double> reach = std::nullopt;

  [[nodiscard]] int last_frame() const { return path.empty() ? frame : path.back().frame; }
};

/// "In this frame, the body has this pose", as far as its modes can (paper: space-time editing,
/// section 6.2).
struct Keyframe {
  std::uint64_t id = 0;  // 0: to be numbered by the session; numbered apart from constraints
  int frame = 0;         // one keyframe in a frame at most
  double weight = 100;   // gamma, > 0, of the distance in modal coordinates; infinity holds exactly
  /// Displacements of the source nodes from rest, 3n [scene length unit]; shared, never changed.
  std::shared_ptr<const Eigen::VectorXd> pose;
};

struct StartMotion;

/// The values that a session edits: plain values, lengths in `length_unit_in_metres`.
struct Scene {
  std::string name;
  bodies::TetMesh mesh;                   // coordinates in scene units
  double length_unit_in_metres = 1;       // 0.001 for a mesh in millimetres
  bodies::Material material;              // where the mesh brings none; SI
  std::optional<double> merge_tolerance;  // [scene length unit]
  std::vector<int> fixed_nodes;           // source node ids; empty: a free body
  int frame_count = 0;
  End first_end = End::kPinnedPositionVelocity;
  End last_end = End::kPinnedPositionVelocity;
  Dynamics dynamics;
  ModelRequest model;
  MaterialOptimisation material_optimisation;
  std::optional<double> constraint_tolerance;  // of soft constraints [scene length unit], > 0
  std::vector<Constraint> constraints;
  std::vector<Keyframe> keyframes;
  /// Base motion that is edited: displacements from rest, 3n x frame_count [scene units]; empty:
  /// the rest shape.
  Eigen::MatrixXd base_motion;
  std::optional<Simulation> simulation;  // no effect on editing
  /// That the body carries along, without effect on it; null: none. Shared, never changed.
  std::shared_ptr<const DetailedSurface> surface;
  /// Start of the solve; null: at rest. Shared, never changed.
  std::shared_ptr<const StartMotion> start = nullptr;
};

/// Of a soft constraint.
inline constexpr double kGreatestWeight = 1e12;
/// No message, file or option can carry the infinite weight itself.
inline constexpr const char* kHowToHoldExactly =
    "to hold exactly, give `exact: true` (--exact) in its place";

/// R that a scene asks for, rigid motions of a free body not counted. A small mesh has fewer than
/// the default.
[[nodiscard]] int candidate_mode_count(const Scene& scene);

inline constexpr const char* kEndsOfCycle =
    "either both ends are cyclic, or none: the last frame leads into the first";

/// How many frames an end condition holds; empty for a number that is not an end condition.
[[nodiscard]] std::optional<int> pinned_frames(End end);
/// The velocity in a frame is the central difference of the shown frames,
/// (u(until) - u(since)) / (until - since) x frames per second. These are the frames before and
/// after it; at the first and the last frame, the frame itself and its only neighbour.
struct VelocitySpan {
  int since = 0, until = 0;
};
/// In a cycle the frame before the first is the last.
[[nodiscard]] VelocitySpan velocity_span(int frame, int frame_count, End first_end = End::kFree);
/// The warning for a constraint in a frame that an end condition holds; empty for others.
[[nodiscard]] std::optional<std::string> idle_frame_warning(int frame, int frame_count,
                                                            End first_end, End last_end);
/// As above; a velocity has no effect where both frames of its span are held.
[[nodiscard]] std::optional<std::string> idle_frame_warning(const Constraint& constraint,
                                                            int frame_count, End first_end,
                                                            End last_end);
/// The warning for a constraint all of whose nodes are fixed.
inline constexpr const char* kIdleNodesWarning =
    "all of them are fixed: the constraint cannot move them";
/// The same of a point or a surface vertex.
inline constexpr const char* kIdlePointWarning =
    "all nodes that it moves with are fixed: the constraint cannot move it";

/// Everything that is wrong with a scene (not just the first thing): meshes, materials, fixed
/// nodes, frames, modes, constraints. Empty: a session can be opened.
[[nodiscard]] std::vector<Issue> validate(const Scene& scene);

}  // namespace limber::scene
