#include "engine/session/bodies/problem_mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/base/error.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::session {

std::string model_notes(const scene::ModelRequest& request, const reduced::ReducedModel& model) {
  std::string notes;
  const auto note = [&](const std::string& text) { append_clause(notes, text); };
  const int elastic = static_cast<int>(model.eigenvalues.size()) - model.rigid_count;
  if (elastic < request.mode_count) {
    note(fmt::format("model.modes: {} used, {} requested: the mesh has no more", elastic,
                     request.mode_count));
  } else if (model.rigid_count > 0) {
    note(fmt::format("model.modes: {} used, the {} requested and {} rigid motions of the free body",
                     request.mode_count + model.rigid_count, request.mode_count,
                     model.rigid_count));
  }
  if (request.basis_size > model.basis_size()) {
    note(fmt::format(
        "model.basis_size: {} used, {} requested: the training poses span no more directions",
        model.basis_size(), request.basis_size));
  }
  if (request.cubature_size > model.cubature_size()) {
    note(fmt::format("model.cubature_size: {} used, {} requested: more tets do not lower the error",
                     model.cubature_size(), request.cubature_size));
  }
  return notes;
}

namespace {

reduced::BasisKind map_basis(scene::Basis basis) {
  switch (basis) {
    case scene::Basis::kBest:
      return reduced::BasisKind::kBest;
    case scene::Basis::kSnapshots:
      return reduced::BasisKind::kSnapshots;
    case scene::Basis::kModalDerivatives:
      return reduced::BasisKind::kModalDerivatives;
    case scene::Basis::kMapDerivatives:
      return reduced::BasisKind::kMapDerivatives;
  }
  LIMBER_DEMAND(false);
  return reduced::BasisKind::kBest;
}

}  // namespace

MappedBody map_body(const scene::Scene& scene) {
  const LengthUnit unit(scene.length_unit_in_metres);
  bodies::TetMesh mesh = scene.mesh;
  mesh.nodes = unit.to_si(scene.mesh.nodes.array()).matrix();
  if (mesh.materials.empty()) {
    mesh.materials = {scene.material};
    mesh.tet_material.assign(static_cast<std::size_t>(mesh.tet_count()), 0);
  }
  bodies::MeshValidationOptions options;
  if (scene.merge_tolerance) options.merge_tolerance = unit.to_si(*scene.merge_tolerance);
  bodies::PreparedMesh prepared = bodies::prepare_mesh(mesh, scene.fixed_nodes, options);

  MappedBody mapped;
  for (const int node : scene.fixed_nodes) {
    mapped.body.fixed_nodes.push_back(
        prepared.compact_of_source.at(static_cast<std::size_t>(node)));
  }
  std::sort(mapped.body.fixed_nodes.begin(), mapped.body.fixed_nodes.end());
  const auto last = std::unique(mapped.body.fixed_nodes.begin(), mapped.body.fixed_nodes.end());
  mapped.body.fixed_nodes.erase(last, mapped.body.fixed_nodes.end());
  mapped.body.mesh = std::move(prepared.mesh);
  mapped.compact_of_source = std::move(prepared.compact_of_source);
  mapped.source_of_compact = std::move(prepared.source_of_compact);
  mapped.repairs = std::move(prepared.repairs);
  mapped.warnings = std::move(prepared.warnings);
  return mapped;
}

reduced::ModelOptions map_model(const scene::Scene& scene, const bodies::ElasticBody& body) {
  const scene::ModelRequest& request = scene.model;
  const int free_nodes = body.mesh.node_count() - static_cast<int>(body.fixed_nodes.size());
  const int elastic = 3 * free_nodes - (body.fixed_nodes.empty() ? 6 : 0);
  reduced::ModelOptions options;
  const int requested_modes = std::max(request.mode_count, scene::candidate_mode_count(scene));
  options.mode_count = std::min(requested_modes, elastic - 1);
  options.tolerance = request.tolerance;
  options.basis_size = request.basis_size;
  options.cubature_size = request.cubature_size;
  options.cubature = request.cubature == scene::Cubature::kWeights
                         ? reduced::CubatureKind::kWeights
                         : reduced::CubatureKind::kFittedMaps;
  options.basis = map_basis(request.basis);
  return options;
}

spacetime::Material map_material(const scene::Dynamics& dynamics, int mode_count,
                                 const reduced::ReducedModel& model) {
  spacetime::Material material;
  material.dynamics =
      map_dynamics(dynamics, model.eigenvalues, model.rigid_count, model.mechanism_count);
  const int modes = std::min(model.coordinate_count(), model.rigid_count + mode_count);
  material.dynamics.stiffness.conservativeResize(modes);
  material.dynamics.damping.conservativeResize(modes);
  if (material.dynamics.shares.size() > 0) material.dynamics.shares.conservativeResize(modes);
  material.mixing = spacetime::first_coordinates(model.coordinate_count(), modes);
  return material;
}

spacetime::MaterialVariables map_variables(scene::MaterialVariables variables) {
  switch (variables) {
    case scene::MaterialVariables::kMotion:
      return spacetime::MaterialVariables::kMotion;
    case scene::MaterialVariables::kDynamics:
      return spacetime::MaterialVariables::kMotionAndDynamics;
    case scene::MaterialVariables::kAll:
      return spacetime::MaterialVariables::kAll;
  }
  LIMBER_DEMAND(false);
  return spacetime::MaterialVariables::kMotion;
}

namespace {

/// Makes E_f the same at every frame rate: at equal seconds it is proportional to frames per
/// second^-3 in frames. For bodies faster than by default it is the same in swings: static forces
/// would grow with the fourth power of the frequency, and soft targets would not be met.
double force_scale(const scene::Dynamics& dynamics, double lowest_eigenvalue) {
  constexpr double kLeast = 1e-12, kMost = 1e12;
  const scene::Dynamics usual;
  const double period = dynamics.period_frames > 0
                            ? dynamics.period_frames / dynamics.frames_per_second
                            : 2 * std::numbers::pi / std::sqrt(lowest_eigenvalue);  // [s]
  const double swings = std::min(1.0, period * usual.frames_per_second / usual.period_frames);
  const double ratio = dynamics.frames_per_second / usual.frames_per_second * swings;
  return std::clamp(ratio * ratio * ratio, kLeast, kMost);
}

/// Forces count as the displacements that they would hold, f / lambda: among all poses that meet a
/// key the nearest to rest is the cheapest. By themselves, forces on the lowest mode are so much
/// cheaper than others that this mode would bend out of all proportion in place of the others.
/// Modes faster than kMost times the lowest count by their forces again, so that more modes change
/// less and less. The lowest, and what nothing or next to nothing holds, have 1.
Eigen::VectorXd force_shares(const Eigen::VectorXd& stiffness, double slowest) {
  constexpr double kMost = 20;
  constexpr double kStiff = kMost * kMost * kMost * kMost;
  return stiffness.unaryExpr([&](double of_mode) {
    const double ratio = std::max(1.0, of_mode / slowest);
    return (1 / (ratio * ratio) + 1 / kStiff) / (1 + 1 / kStiff);
  });
}

}  // namespace

spacetime::ModeDynamics map_dynamics(const scene::Dynamics& dynamics,
                                     const Eigen::VectorXd& eigenvalues, int rigid_count,
                                     int mechanism_count) {
  const Eigen::Index count = eigenvalues.size();
  LIMBER_DEMAND(rigid_count >= 0 && rigid_count < count);
  const Eigen::Index elastic = count - rigid_count;
  spacetime::ModeDynamics mapped{Eigen::VectorXd::Zero(count), Eigen::VectorXd::Zero(count)};
  const double lowest =
      eigenvalues[reduced::reference_mode(static_cast<int>(count), rigid_count, mechanism_count)];
  if (dynamics.period_frames > 0) {
    const double turn = 2 * std::numbers::pi / dynamics.period_frames;  // [1/frame]
    mapped.stiffness.tail(elastic) = eigenvalues.tail(elastic) / lowest * (turn * turn);
  } else {
    const double fps = dynamics.frames_per_second;
    mapped.stiffness.tail(elastic) = eigenvalues.tail(elastic) / (fps * fps);
  }
  // A mode this stiff does not move in double precision: the solver's bound.
  constexpr double kStiffest = 1e12;
  mapped.stiffness = mapped.stiffness.cwiseMin(kStiffest);
  mapped.damping = 2 * dynamics.damping_ratio * mapped.stiffness.cwiseSqrt();
  mapped.smoothing = dynamics.force_smoothing * dynamics.frames_per_second;
  if (dynamics.discretisation == scene::Discretisation::kSampled) {
    mapped.discretisation = spacetime::Discretisation::kSampled;
    const double slowest = mapped.stiffness[reduced::reference_mode(static_cast<int>(count),
                                                                    rigid_count, mechanism_count)];
    mapped.damping = 2 * dynamics.damping_ratio / std::sqrt(slowest) * mapped.stiffness;
    mapped.scale = force_scale(dynamics, lowest);
    mapped.shares = force_shares(mapped.stiffness, slowest);
  }
  return mapped;
}

spacetime::EndCondition map_end(scene::End end) {
  switch (end) {
    case scene::End::kFree:
      return spacetime::EndCondition::kFree;
    case scene::End::kPinnedPosition:
      return spacetime::EndCondition::kPinnedPosition;
    case scene::End::kPinnedPositionVelocity:
      return spacetime::EndCondition::kPinnedPositionVelocity;
    case scene::End::kCyclic:
      return spacetime::EndCondition::kCyclic;
  }
  LIMBER_DEMAND(false);
  return spacetime::EndCondition::kFree;
}

Eigen::MatrixXd map_base_motion(const scene::Scene& scene,
                                const std::vector<int>& source_of_compact) {
  return map_displacements(scene, scene.base_motion, source_of_compact);
}

Eigen::MatrixXd map_displacements(const scene::Scene& scene,
                                  const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                                  const std::vector<int>& source_of_compact) {
  const LengthUnit unit(scene.length_unit_in_metres);
  const Eigen::Index count = static_cast<Eigen::Index>(source_of_compact.size());
  Eigen::MatrixXd mapped(3 * count, displacements.cols());
  for (Eigen::Index node = 0; node < count; ++node) {
    const Eigen::Index source = source_of_compact[static_cast<std::size_t>(node)];
    mapped.middleRows(3 * node, 3) =
        unit.to_si(displacements.middleRows(3 * source, 3).array()).matrix();
  }
  return mapped;
}

TargetFrame::TargetFrame(const scene::Scene& scene, const MappedBody& mapped,
                         std::shared_ptr<const scene::SurfacePoints> points)
    : rest_(scene.mesh.nodes),
      points_(points ? std::move(points) : std::make_shared<const scene::SurfacePoints>(scene)),
      compact_of_source_(mapped.compact_of_source),
      source_of_compact_(mapped.source_of_compact),
      unit_(scene.length_unit_in_metres) {}

reduced::Site TargetFrame::site(const scene::Constraint& constraint) const {
  const scene::NodeMean mean = points_->nodes_of(constraint);
  reduced::Site site;
  if (mean.weights.empty()) {
    site.nodes.reserve(mean.nodes.size());
    for (const int node : mean.nodes)
      site.nodes.push_back(compact_of_source_.at(static_cast<std::size_t>(node)));
    std::sort(site.nodes.begin(), site.nodes.end());
    site.nodes.erase(std::unique(site.nodes.begin(), site.nodes.end()), site.nodes.end());
    return site;
  }
  std::map<int, double> weights;
  double sum = 0;
  for (std::size_t i = 0; i < mean.nodes.size(); ++i)
    weights[compact_of_source_.at(static_cast<std::size_t>(mean.nodes[i]))] += mean.weights[i];
  for (const auto& [node, weight] : weights) sum += weight;
  for (const auto& [node, weight] : weights) {
    if (weight == 0) continue;
    site.nodes.push_back(node);
    site.weights.push_back(weight / sum);
  }
  if (site.nodes.size() == 1) site.weights.clear();
  return site;
}

Eigen::Vector3d TargetFrame::origin(scene::TargetKind kind, const reduced::Site& site) const {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  if (kind != scene::TargetKind::kPosition) return mean;
  const auto rest = [&](std::size_t i) {
    return rest_.col(source_of_compact_[static_cast<std::size_t>(site.nodes[i])]);
  };
  if (site.weights.empty()) {
    for (std::size_t i = 0; i < site.nodes.size(); ++i) mean += rest(i);
    return mean / static_cast<double>(site.nodes.size());
  }
  for (std::size_t i = 0; i < site.nodes.size(); ++i) mean += site.weights[i] * rest(i);
  return mean;
}

Eigen::Vector3d TargetFrame::displacement(const Eigen::Vector3d& target,
                                          const Eigen::Vector3d& origin) const {
  const Eigen::Vector3d relative = target - origin;
  return unit_.to_si(relative.array()).matrix();
}

}  // namespace limber::session
