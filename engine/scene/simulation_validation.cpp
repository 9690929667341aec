#include "engine/scene/simulation_validation.h"

#include <fmt/format.h>

#include <cmath>
#include <unordered_set>

namespace limber::scene {
namespace {

/// Enough issues of a list to understand its fault.
constexpr int kMaxListedIssues = 20;

class SimulationValidator {
 public:
  SimulationValidator(const Scene& scene, const Simulation& simulation)
      : scene_(scene),
        simulation_(simulation),
        fixed_(scene.fixed_nodes.begin(), scene.fixed_nodes.end()) {
    const int nodes = scene.mesh.node_count();
    used_.assign(static_cast<std::size_t>(nodes), false);
    for (const int node : scene.mesh.tets.reshaped()) {
      if (node >= 0 && node < nodes) used_[static_cast<std::size_t>(node)] = true;
    }
  }

  std::vector<Issue> run() {
    if (!simulation_.gravity.allFinite()) error("gravity", "has a coordinate that is not finite");
    for (std::size_t i = 0; i < simulation_.forces.size(); ++i)
      check_force(fmt::format("forces[{}].", i), simulation_.forces[i]);
    check_initial();
    check_stepping();
    return std::move(issues_);
  }

 private:
  void error(const std::string& field, std::string message,
             ErrorCode code = ErrorCode::kInvalidArgument) {
    issues_.push_back({Issue::Severity::kError, "simulation." + field, std::move(message), code});
  }
  void warning(const std::string& field, std::string message) {
    issues_.push_back({Issue::Severity::kWarning, "simulation." + field, std::move(message)});
  }

  void check_force(const std::string& field, const NodalForce& force) {
    check_nodes(field + "nodes", force.nodes);
    if (!force.force.allFinite()) error(field + "force", "has a coordinate that is not finite");
    check_interval(field, force);
    if (force.profile == bodies::ForceProfile::kSine) {
      if (!(force.period_frames > 0) || !std::isfinite(force.period_frames)) {
        error(field + "period_frames",
              fmt::format("must be > 0 and finite, is {:g}", force.period_frames));
      }
    } else if (force.period_frames != 0) {
      error(field + "period_frames",
            fmt::format("is {:g}, but only a sine has a period", force.period_frames));
    }
  }

  void check_interval(const std::string& field, const NodalForce& force) {
    if (!(force.from_frame >= 0) || !std::isfinite(force.from_frame)) {
      error(field + "from_frame",
            fmt::format("must be >= 0 and finite, is {:g}", force.from_frame));
    } else if (!(force.until_frame > force.from_frame)) {
      error(field + "until_frame", fmt::format("must be > from_frame = {:g}, is {:g}",
                                               force.from_frame, force.until_frame));
    } else if (force.from_frame >= scene_.frame_count - 1) {
      warning(field + "from_frame",
              fmt::format("begins in frame {:g}, the last one is {}: the force does nothing",
                          force.from_frame, scene_.frame_count - 1));
    }
  }

  void check_nodes(const std::string& field, const std::vector<int>& nodes) {
    if (nodes.empty()) return error(field, "must name at least one node");
    const int count = scene_.mesh.node_count();
    if (count == 0) return;  // reported of the mesh already
    bool movable = false;
    std::unordered_set<int> distinct_nodes;
    int wrong = 0;
    for (std::size_t i = 0; i < nodes.size() && wrong < kMaxListedIssues; ++i) {
      const int node = nodes[i];
      const std::string entry = fmt::format("{}[{}]", field, i);
      if (node < 0 || node >= count) {
        error(entry, fmt::format("node id {} is out of range: the mesh has {} nodes", node, count),
              ErrorCode::kOutOfRange);
      } else if (!used_[static_cast<std::size_t>(node)]) {
        error(entry, fmt::format("node {} belongs to no tet", node));
      } else if (!distinct_nodes.insert(node).second) {
        error(entry, fmt::format("node {} is given twice", node));
      } else {
        movable = movable || !fixed_.contains(node);
        continue;
      }
      ++wrong;
    }
    if (wrong == 0 && !movable) warning(field, "all of them are fixed: the force moves nothing");
  }

  void check_initial() {
    const InitialState& initial = simulation_.initial;
    check_field("initial.displacements", initial.displacement);
    check_field("initial.velocities", initial.velocity);
    if (!initial.common_velocity.allFinite())
      error("initial.velocity", "has a coordinate that is not finite");
    for (std::size_t k = 0; k < initial.modes.size(); ++k) {
      if (std::isfinite(initial.modes[k])) continue;
      error(fmt::format("initial.modes[{}]", k), "is not finite");
      break;
    }
    check_mode_count(static_cast<int>(initial.modes.size()));
  }

  void check_mode_count(int modes) {
    int movable = 0;
    for (std::size_t node = 0; node < used_.size(); ++node)
      movable += used_[node] && !fixed_.contains(static_cast<int>(node)) ? 1 : 0;
    const int degrees = 3 * movable - (scene_.fixed_nodes.empty() ? 6 : 0);
    if (modes > 0 && modes >= degrees) {
      error("initial.modes",
            fmt::format("are {}, must be fewer than the {} elastic degrees of freedom", modes,
                        degrees));
    }
  }

  /// Checks vectors of all nodes: fixed nodes must not move.
  void check_field(const std::string& field, const Eigen::VectorXd& values) {
    if (values.size() == 0 || scene_.mesh.node_count() == 0) return;
    const Eigen::Index expected = 3 * static_cast<Eigen::Index>(scene_.mesh.node_count());
    if (values.size() != expected) {
      return error(field, fmt::format("has {} nodes, the mesh has {}", values.size() / 3,
                                      scene_.mesh.node_count()));
    }
    if (!values.allFinite()) return error(field, "has a value that is not finite");
    int wrong = 0;
    for (const int node : scene_.fixed_nodes) {
      if (node < 0 || node >= scene_.mesh.node_count()) continue;
      if (values.segment<3>(3 * node).isZero(0)) continue;
      error(field, fmt::format("moves node {}, which is fixed", node));
      if (++wrong == kMaxListedIssues) return;
    }
  }

  void check_stepping() {
    const auto not_negative = [&](const char* field, double value) {
      if (!(value >= 0) || !std::isfinite(value))
        error(field, fmt::format("must be >= 0 and finite, is {:g}", value));
    };
    if (const auto& fps = simulation_.frames_per_second;
        fps && (!(*fps > 0) || !std::isfinite(*fps)))
      error("frames_per_second", fmt::format("must be > 0 and finite, is {:g}", *fps));
    if (simulation_.steps_per_frame < 1 || simulation_.steps_per_frame > kMaxStepsPerFrame) {
      error("steps_per_frame", fmt::format("must be in [1, {}], is {}", kMaxStepsPerFrame,
                                           simulation_.steps_per_frame));
    }
    not_negative("mass_damping", simulation_.mass_damping);
    not_negative("relaxation_time", simulation_.relaxation_time);
  }

  const Scene& scene_;
  const Simulation& simulation_;
  std::unordered_set<int> fixed_;
  std::vector<bool> used_;
  std::vector<Issue> issues_;
};

}  // namespace

std::vector<Issue> simulation_issues(const Scene& scene) {
  if (!scene.simulation) return {};
  return SimulationValidator(scene, *scene.simulation).run();
}

}  // namespace limber::scene
