#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_set>

#include "engine/base/error.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/scene/constraint_path.h"
#include "engine/scene/embedding/surface_points.h"
#include "engine/scene/keyframe_rules.h"
#include "engine/scene/pose_rules.h"
#include "engine/scene/scene.h"
#include "engine/scene/simulation_validation.h"

namespace limber::scene {
namespace {

using Severity = Issue::Severity;

/// Enough to understand the fault; a mesh of a million NaNs does not need a million messages.
constexpr int kMaxIssuesPerKind = 20;

/// Bounds of E [Pa], rho [kg/m^3] and the body's length [m]. A model can be built at every corner
/// of these bounds; the products of far larger or smaller values leave the range of double.
constexpr double kSmallest = 1e-30, kLargest = 1e30;

std::string number(double value) { return fmt::format("{:g}", value); }

class SceneValidator {
 public:
  explicit SceneValidator(const Scene& scene) : scene_(scene), points_(scene) {}

  std::vector<Issue> run() {
    check_plain_values();
    check_model();
    check_mesh();
    check_constraints();
    check_base_motion();
    for (Issue& issue : keyframe_issues(scene_)) issues_.push_back(std::move(issue));
    for (Issue& issue : simulation_issues(scene_)) issues_.push_back(std::move(issue));
    return std::move(issues_);
  }

 private:
  void error(std::string field, std::string message, ErrorCode code = ErrorCode::kInvalidArgument) {
    issues_.push_back({Severity::kError, std::move(field), std::move(message), code});
  }
  void warning(std::string field, std::string message) {
    issues_.push_back({Severity::kWarning, std::move(field), std::move(message)});
  }
  static std::string indexed(const char* name, std::size_t index) {
    return std::string(name) + "[" + std::to_string(index) + "]";
  }

  /// Calls `check(i)` for i in [0, count) until it has returned true kMaxIssuesPerKind times, then
  /// says it stopped.
  template <typename Check>
  bool check_each(const char* field, std::size_t count, const Check& check) {
    int found = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!check(i)) continue;
      if (++found == kMaxIssuesPerKind) {
        error(field,
              "there may be more such values; the first " + std::to_string(found) + " are listed");
        break;
      }
    }
    return found == 0;
  }

  // Conditions are written so that NaN fails them.
  void check_plain_values() {
    unit_ok_ = check_magnitude("length_unit_in_metres", scene_.length_unit_in_metres, "m");
    check_material("material", scene_.material);
    if (scene_.merge_tolerance &&
        (!(*scene_.merge_tolerance >= 0) || !std::isfinite(*scene_.merge_tolerance))) {
      error("merge_tolerance", "must be >= 0 and finite, is " + number(*scene_.merge_tolerance));
      unit_ok_ = false;
    }
    const int pinned =
        pinned_frames(scene_.first_end).value_or(0) + pinned_frames(scene_.last_end).value_or(0);
    if (const int least = std::max(3, pinned + 1); scene_.frame_count < least) {
      error("frames", fmt::format("must be at least {}{}, is {}", least,
                                  pinned < 3 ? "" : fmt::format(", as the ends hold {}", pinned),
                                  scene_.frame_count));
    }
    if ((scene_.first_end == End::kCyclic) != (scene_.last_end == End::kCyclic))
      error("last_end", kEndsOfCycle);
    const Dynamics& dynamics = scene_.dynamics;
    if (!(dynamics.frames_per_second > 0) || !std::isfinite(dynamics.frames_per_second)) {
      error("dynamics.frames_per_second",
            "must be > 0 and finite, is " + number(dynamics.frames_per_second));
    }
    if (!(dynamics.period_frames >= 0) || !std::isfinite(dynamics.period_frames)) {
      error("dynamics.period_frames",
            "must be > 0 frames, or 0 for the period that follows from the materials, is " +
                number(dynamics.period_frames));
    } else if (dynamics.period_frames > 0 && dynamics.period_frames < 4) {
      warning("dynamics.period_frames", "fewer than 4 frames per swing (" +
                                            number(dynamics.period_frames) +
                                            ") cannot show the swing");
    }
    if (!(dynamics.damping_ratio >= 0 && dynamics.damping_ratio < 1)) {
      error("dynamics.damping_ratio", "must be in [0, 1), is " + number(dynamics.damping_ratio));
    }
    if (!(dynamics.force_smoothing >= 0) || !std::isfinite(dynamics.force_smoothing)) {
      error("dynamics.force_smoothing",
            "must be >= 0 s and finite, is " + number(dynamics.force_smoothing));
    }
    if (dynamics.inertia > 0 && scene_.base_motion.size() == 0)
      warning("dynamics.inertia", "has no effect: the scene has no base motion");
  }

  bool check_magnitude(const std::string& field, double value, const char* unit) {
    if (value >= kSmallest && value <= kLargest) return true;
    const std::string rule = value > 0 && std::isfinite(value)
                                 ? fmt::format("in [{:g}, {:g}] {}", kSmallest, kLargest, unit)
                                 : "> 0 and finite";
    error(field, "must be " + rule + ", is " + number(value));
    return false;
  }

  bool check_material(const std::string& field, const bodies::Material& material) {
    const std::size_t before = issues_.size();
    check_magnitude(field + ".youngs_modulus", material.youngs_modulus, "Pa");
    if (!(material.poissons_ratio > -1 && material.poissons_ratio < 0.5)) {
      error(field + ".poissons_ratio",
            "must be in (-1, 0.5), is " + number(material.poissons_ratio));
    }
    check_magnitude(field + ".density", material.density, "kg/m^3");
    return issues_.size() == before;
  }

  void check_model() {
    const ModelRequest& model = scene_.model;
    if (model.mode_count <= 0)
      error("model.modes", "must be > 0, is " + std::to_string(model.mode_count));
    if (model.candidate_modes != 0 && model.candidate_modes < model.mode_count) {
      error("model.candidate_modes",
            fmt::format("must be >= model.modes = {}, or 0 to choose, is {}", model.mode_count,
                        model.candidate_modes));
    }
    const double column_weight = scene_.material_optimisation.column_weight;
    if (!(column_weight >= 0 && column_weight <= kGreatestWeight)) {
      error("material_optimisation.column_weight",
            fmt::format("must be in [0, {:g}], is {}", kGreatestWeight, number(column_weight)));
    }
    check_fitted_frequencies();
    const auto& within = scene_.constraint_tolerance;
    if (within && !(*within > 0 && std::isfinite(*within)))
      error("constraint_tolerance", "must be > 0, is " + number(*within));
    if (!(model.tolerance > 1e-6 && model.tolerance < 1)) {
      error("model.tolerance", "must be in (1e-6, 1), is " + number(model.tolerance));
    }
    if (model.basis_size < 0) {
      error("model.basis_size", "must be >= 0, is " + std::to_string(model.basis_size));
    }
    if (model.cubature_size < 0) {
      error("model.cubature_size", "must be >= 0, is " + std::to_string(model.cubature_size));
    } else if (scene_.mesh.tet_count() > 0 && model.cubature_size > scene_.mesh.tet_count()) {
      error("model.cubature_size", "is " + std::to_string(model.cubature_size) +
                                       ", more than the mesh's " +
                                       std::to_string(scene_.mesh.tet_count()) + " tets");
    }
  }

  void check_fitted_frequencies() {
    const MaterialOptimisation& optimisation = scene_.material_optimisation;
    const double nyquist = 0.5 * scene_.dynamics.frames_per_second;
    if (const auto& frequency = optimisation.max_frequency_hz;
        frequency && !(*frequency > 0 && *frequency <= nyquist)) {
      error("material_optimisation.max_frequency_hz",
            fmt::format("must be > 0 and <= {:g} Hz, half of dynamics.frames_per_second, is {}",
                        nyquist, number(*frequency)));
    }
    if (optimisation.slow_steps < 0 ||
        optimisation.slow_steps > MaterialOptimisation::kMaxSlowSteps) {
      error("material_optimisation.slow_steps",
            fmt::format("must be in [0, {}], is {}", MaterialOptimisation::kMaxSlowSteps,
                        optimisation.slow_steps));
    }
  }

  void check_mesh() {
    const bodies::TetMesh& mesh = scene_.mesh;
    if (mesh.node_count() == 0) error("mesh.nodes", "the mesh has no nodes");
    if (mesh.tet_count() == 0) error("mesh.tets", "the mesh has no tets");
    bool good = mesh.node_count() > 0 && mesh.tet_count() > 0;
    good &=
        check_each("mesh.nodes", static_cast<std::size_t>(mesh.node_count()), [&](std::size_t i) {
          const bool bad = !mesh.nodes.col(static_cast<Eigen::Index>(i)).allFinite();
          if (bad) error(indexed("mesh.nodes", i), "has a coordinate that is not finite");
          return bad;
        });
    used_.assign(static_cast<std::size_t>(mesh.node_count()), false);
    good &= check_each("mesh.tets", static_cast<std::size_t>(mesh.tet_count()),
                       [&](std::size_t i) { return bad_tet(i); });
    good &= check_materials();
    good &= check_fixed_nodes();
    if (good && unit_ok_ && check_length()) mesh_ok_ = check_prepared();
  }

  /// The unit and the coordinates may each be fine.
  bool check_length() {
    const auto& nodes = scene_.mesh.nodes;
    const double length = scene_.length_unit_in_metres *
                          (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).stableNorm();
    if (length == 0) return true;  // its tets have no volume: reported below, for each
    if (length >= kSmallest && length <= kLargest) return true;
    error("mesh.nodes", fmt::format("the body must be {:g} to {:g} m long, is {:g}", kSmallest,
                                    kLargest, length));
    return false;
  }

  bool bad_tet(std::size_t tet) {
    const Eigen::Vector4i nodes = scene_.mesh.tets.col(static_cast<Eigen::Index>(tet));
    for (int a = 0; a < 4; ++a) {
      if (nodes[a] < 0 || nodes[a] >= scene_.mesh.node_count()) {
        error(indexed("mesh.tets", tet),
              "node id " + std::to_string(nodes[a]) + " is out of range: the mesh has " +
                  std::to_string(scene_.mesh.node_count()) + " nodes",
              ErrorCode::kOutOfRange);
        return true;
      }
      used_[static_cast<std::size_t>(nodes[a])] = true;
      for (int b = 0; b < a; ++b) {
        if (nodes[a] == nodes[b]) {
          error(indexed("mesh.tets", tet), "uses node " + std::to_string(nodes[a]) + " twice");
          return true;
        }
      }
    }
    return false;
  }

  bool check_materials() {
    const bodies::TetMesh& mesh = scene_.mesh;
    bool good = check_each("mesh.materials", mesh.materials.size(), [&](std::size_t i) {
      return !check_material(indexed("mesh.materials", i), mesh.materials[i]);
    });
    const std::size_t expected =
        mesh.materials.empty() ? 0 : static_cast<std::size_t>(mesh.tet_count());
    if (mesh.tet_material.size() != expected) {
      error("mesh.tet_material", "must have " + std::to_string(expected) + " entries, has " +
                                     std::to_string(mesh.tet_material.size()));
      return false;
    }
    good &= check_each("mesh.tet_material", mesh.tet_material.size(), [&](std::size_t i) {
      const int material = mesh.tet_material[i];
      const bool bad = material < 0 || material >= static_cast<int>(mesh.materials.size());
      if (bad) {
        error(indexed("mesh.tet_material", i),
              "material " + std::to_string(material) + " is out of range: there are " +
                  std::to_string(mesh.materials.size()),
              ErrorCode::kOutOfRange);
      }
      return bad;
    });
    return good;
  }

  bool check_fixed_nodes() {
    const bool in_range = check_each("fixed_nodes", scene_.fixed_nodes.size(), [&](std::size_t i) {
      return !check_node(indexed("fixed_nodes", i), scene_.fixed_nodes[i]);
    });
    std::size_t repeated = 0;
    for (const int node : scene_.fixed_nodes) repeated += fixed_.insert(node).second ? 0 : 1;
    if (repeated > 0) {
      warning("fixed_nodes", std::to_string(repeated) + " node ids are given more than once");
    }
    return in_range;
  }

  bool check_node(const std::string& field, int node) {
    if (scene_.mesh.node_count() == 0) return true;  // reported of the mesh already
    if (node < 0 || node >= scene_.mesh.node_count()) {
      error(field,
            "node id " + std::to_string(node) + " is out of range: the mesh has " +
                std::to_string(scene_.mesh.node_count()) + " nodes",
            ErrorCode::kOutOfRange);
      return false;
    }
    if (!used_[static_cast<std::size_t>(node)]) {
      error(field, "node " + std::to_string(node) + " belongs to no tet");
      return false;
    }
    return true;
  }

  /// Faults that only the assembled mesh shows: volumes, pieces.
  bool check_prepared() {
    bodies::TetMesh in_metres = scene_.mesh;
    in_metres.nodes *= scene_.length_unit_in_metres;
    bodies::MeshValidationOptions options;
    if (scene_.merge_tolerance)
      options.merge_tolerance = *scene_.merge_tolerance * scene_.length_unit_in_metres;
    try {
      const bodies::PreparedMesh prepared =
          bodies::prepare_mesh(in_metres, scene_.fixed_nodes, options);
      for (const std::string& repair : prepared.repairs) warning("mesh", repair);
      for (const std::string& text : prepared.warnings) warning("mesh", text);
      std::unordered_set<int> fixed;
      for (const int node : scene_.fixed_nodes)
        fixed.insert(prepared.compact_of_source[static_cast<std::size_t>(node)]);
      check_mode_count(3 * (prepared.mesh.node_count() - static_cast<int>(fixed.size())) -
                       (fixed.empty() ? 6 : 0));
    } catch (const Error& problem) {
      error(problem.field().empty() ? "mesh" : problem.field(), problem.what(), problem.code());
      return false;
    }
    return true;
  }

  void check_mode_count(int elastic_degrees) {
    if (elastic_degrees <= 0) {
      error("fixed_nodes", "every node is fixed: nothing can move");
    } else if (scene_.model.mode_count == ModelRequest::kDefaultModes && elastic_degrees > 1) {
      if (scene_.model.mode_count >= elastic_degrees) {
        warning("model.modes",
                fmt::format("the mesh has fewer elastic degrees of freedom ({}) than the default "
                            "number of modes ({}): {} are used",
                            elastic_degrees, scene_.model.mode_count, elastic_degrees - 1));
      }
    } else if (scene_.model.mode_count >= elastic_degrees) {
      error("model.modes", "must be below the " + std::to_string(elastic_degrees) +
                               " elastic degrees of freedom, is " +
                               std::to_string(scene_.model.mode_count));
    }
    if (elastic_degrees > 0 && scene_.model.candidate_modes >= elastic_degrees) {
      error("model.candidate_modes", "must be below the " + std::to_string(elastic_degrees) +
                                         " elastic degrees of freedom, is " +
                                         std::to_string(scene_.model.candidate_modes));
    }
    const int degrees = elastic_degrees + (scene_.fixed_nodes.empty() ? 6 : 0);
    if (elastic_degrees > 0 && scene_.model.basis_size > degrees) {
      warning("model.basis_size", fmt::format("is {}, more than the {} degrees of freedom: at most "
                                              "so many are used",
                                              scene_.model.basis_size, degrees));
    }
  }

  void check_constraints() {
    std::set<std::uint64_t> ids;
    for (std::size_t i = 0; i < scene_.constraints.size(); ++i) {
      const Constraint& constraint = scene_.constraints[i];
      const std::string field = indexed("constraints", i);
      if (constraint.id != 0 && !ids.insert(constraint.id).second) {
        error(field + ".id", "the id " + std::to_string(constraint.id) + " is taken",
              ErrorCode::kAlreadyExists);
      }
      check_constraint_frame(field, constraint);
      if (constraint.point || constraint.surface_vertex) {
        check_surface_point(field, constraint);
      } else {
        check_constraint_nodes(field, constraint);
      }
      if (constraint.axes == 0 || constraint.axes > 7) {
        error(field + ".axes", "must name at least one of x, y and z (1 to 7), is " +
                                   std::to_string(constraint.axes));
      }
      if (!constraint.target.allFinite())
        error(field + ".target", "has a coordinate that is not finite");
      try {
        check_path(constraint, scene_.frame_count);
      } catch (const Error& problem) {
        error(field + "." + problem.field(), problem.what(), problem.code());
      }
      if (std::isfinite(constraint.weight) && constraint.weight > kGreatestWeight) {
        error(field + ".weight",
              fmt::format("must be <= {:g}, is {:g} ({})", kGreatestWeight, constraint.weight,
                          kHowToHoldExactly),
              ErrorCode::kOutOfRange);
      } else if (!(constraint.weight > 0)) {
        error(field + ".weight",
              fmt::format("must be > 0, is {:g} ({})", constraint.weight, kHowToHoldExactly));
      }
    }
  }

  void check_constraint_frame(const std::string& field, const Constraint& constraint) {
    const int frames = scene_.frame_count;
    if (constraint.frame < 0 || constraint.frame >= frames) {
      error(field + ".frame",
            "frame " + std::to_string(constraint.frame) + " is out of range: there are " +
                std::to_string(frames) + " frames",
            ErrorCode::kOutOfRange);
    } else if (const auto text =
                   idle_frame_warning(constraint, frames, scene_.first_end, scene_.last_end)) {
      warning(field + ".frame", *text);
    }
  }

  void check_surface_point(const std::string& field, const Constraint& constraint) {
    if (!points_.can_check(constraint)) return;  // the mesh is complained about already
    try {
      points_.check(constraint);
    } catch (const Error& problem) {
      error(field + "." + problem.field(), problem.what(), problem.code());
      return;
    }
    if (mesh_ok_ &&
        is_fixed(points_.nodes_of(constraint), [&](int node) { return fixed_.count(node) > 0; })) {
      warning(field + (constraint.point ? ".point" : ".surface_vertex"), kIdlePointWarning);
    }
  }

  void check_constraint_nodes(const std::string& field, const Constraint& constraint) {
    if (constraint.nodes.empty())
      error(field + ".nodes", "must name at least one node, if it names no point of a surface");
    bool movable = constraint.nodes.empty();
    std::unordered_set<int> distinct_nodes;
    int wrong = 0;
    for (std::size_t n = 0; n < constraint.nodes.size(); ++n) {
      const std::string node_field = field + "." + indexed("nodes", n);
      const int node = constraint.nodes[n];
      if (!check_node(node_field, node)) {
        movable = true;  // complained about already
        if (++wrong == kMaxIssuesPerKind) return;
        continue;
      }
      if (!distinct_nodes.insert(node).second) {
        error(node_field, "node " + std::to_string(node) + " is given twice");
        if (++wrong == kMaxIssuesPerKind) return;
      }
      movable = movable || fixed_.count(node) == 0;
    }
    if (!movable) warning(field + ".nodes", kIdleNodesWarning);
  }

  void check_base_motion() {
    const Eigen::MatrixXd& motion = scene_.base_motion;
    if (motion.size() == 0) return;
    const Eigen::Index rows = 3 * static_cast<Eigen::Index>(scene_.mesh.node_count());
    if (motion.rows() != rows) {
      error("base_motion", fmt::format("has {} nodes, the mesh has {}", motion.rows() / 3,
                                       scene_.mesh.node_count()));
    } else if (motion.cols() != scene_.frame_count) {
      error("base_motion",
            fmt::format("has {} frames, the scene has {}", motion.cols(), scene_.frame_count));
    } else {
      const double reach = reach_of_poses(scene_);
      for (Eigen::Index frame = 0; frame < motion.cols(); ++frame) {
        const auto fault = pose_fault(motion.col(frame), reach);
        if (!fault) continue;
        error("base_motion", fmt::format("{} in frame {}", fault->message, frame), fault->code);
        return;
      }
    }
  }

  const Scene& scene_;
  std::vector<Issue> issues_;
  std::vector<bool> used_;
  std::unordered_set<int> fixed_;
  bool unit_ok_ = true, mesh_ok_ = false;
  SurfacePoints points_;
};

}  // namespace

int candidate_mode_count(const Scene& scene) {
  const ModelRequest& model = scene.model;
  if (model.candidate_modes > 0) return model.candidate_modes;
  if (scene.material_optimisation.variables != MaterialVariables::kAll) return model.mode_count;
  return std::max(model.mode_count, ModelRequest::kDefaultCandidates);
}

std::optional<int> pinned_frames(End end) {
  switch (end) {
    case End::kFree:
    case End::kCyclic:
      return 0;
    case End::kPinnedPosition:
      return 1;
    case End::kPinnedPositionVelocity:
      return 2;
  }
  return std::nullopt;
}

namespace {

/// Warning for a path whose frames are all held.
std::optional<std::string> idle_path_warning(const Constraint& path, int frame_count, End first_end,
                                             End last_end) {
  if (path.last_frame() >= pinned_frames(first_end).value_or(0) &&
      path.frame < frame_count - pinned_frames(last_end).value_or(0))
    return std::nullopt;
  return fmt::format("frames {} to {} are held by the end condition: the path cannot change them",
                     path.frame, path.last_frame());
}

}  // namespace

std::optional<std::string> idle_frame_warning(int frame, int frame_count, End first_end,
                                              End last_end) {
  if (frame >= pinned_frames(first_end).value_or(0) &&
      frame < frame_count - pinned_frames(last_end).value_or(0))
    return std::nullopt;
  return fmt::format("frame {} is held by the end condition: the constraint cannot change it",
                     frame);
}

VelocitySpan velocity_span(int frame, int frame_count, End first_end) {
  if (first_end == End::kCyclic)
    return {(frame + frame_count - 1) % frame_count, (frame + 1) % frame_count};
  return {std::max(0, frame - 1), std::min(frame_count - 1, frame + 1)};
}

std::optional<std::string> idle_frame_warning(const Constraint& constraint, int frame_count,
                                              End first_end, End last_end) {
  if (!constraint.path.empty())
    return idle_path_warning(constraint, frame_count, first_end, last_end);
  if (constraint.kind != TargetKind::kVelocity)
    return idle_frame_warning(constraint.frame, frame_count, first_end, last_end);
  const auto [since, until] = velocity_span(constraint.frame, frame_count, first_end);
  if (!idle_frame_warning(since, frame_count, first_end, last_end) ||
      !idle_frame_warning(until, frame_count, first_end, last_end))
    return std::nullopt;
  return fmt::format(
      "frames {} and {}, whose difference is the velocity, are held by the end conditions: the "
      "constraint cannot change it",
      since, until);
}

std::vector<Issue> validate(const Scene& scene) { return SceneValidator(scene).run(); }

}  // namespace limber::scene
