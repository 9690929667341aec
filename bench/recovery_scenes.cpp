#include "bench/recovery_scenes.h"

#include <cmath>
#include <filesystem>

#include "engine/base/error.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/mesh_validation.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/bodies/simulation.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/scene/formats/mesh_formats.h"

namespace limber::bench {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kFramesPerSwing = 30;
constexpr double kDampingRatio = 0.01;
constexpr int kPush = 15;            // frames in each direction
constexpr double kPushForce = 0.5;   // [N] in all
constexpr double kStaticSway = 0.1;  // body lengths, of the linear equilibrium

/// The body with the materials of its file: its mesh is numbered as that of load_body().
bodies::ElasticBody with_materials(const bodies::ElasticBody& body, const std::string& name,
                                   const SuiteOptions& options) {
  const auto file =
      std::filesystem::path(options.shared_folder) / "data" / "bodies" / name / "mesh.abq";
  bodies::ElasticBody result = body;
  result.mesh = bodies::prepare_mesh(scene::read_mesh_file(file).mesh, {}).mesh;
  LIMBER_DEMAND(result.mesh.tets == body.mesh.tets && result.mesh.materials.size() > 1);
  return result;
}

/// Up is y, the thin side of the beam.
bodies::Loads push_end(const bodies::ElasticBody& body, double frames_per_second, double share) {
  bodies::PointForce push;
  const double end = body.mesh.nodes.row(0).maxCoeff();
  for (int node = 0; node < body.mesh.node_count(); ++node) {
    if (body.mesh.nodes(0, node) > end - 1e-6 * body.length()) push.nodes.push_back(node);
  }
  push.force = {0, share * kPushForce, 0};
  push.until = kPush / frames_per_second;
  bodies::PointForce back = push;
  back.force = -push.force;
  back.from = push.until;
  back.until = 2 * push.until;
  return {{0, 0, 0}, {push, back}};
}

/// Rest under an acceleration along the shorter horizontal side, as strong as the softest modes
/// say for a sway of so many body lengths.
bodies::DynamicState held_aside(const bodies::ElasticBody& body, const bodies::ModalBasis& modes,
                                double sway) {
  const Eigen::Vector3d size =
      body.mesh.nodes.rowwise().maxCoeff() - body.mesh.nodes.rowwise().minCoeff();
  const int axis = size.x() < size.z() ? 0 : 2;
  const Eigen::SparseMatrix<double> mass = bodies::mass_matrix(body.mesh);
  Eigen::VectorXd field = Eigen::VectorXd::Zero(mass.rows());
  for (Eigen::Index i = axis; i < field.size(); i += 3) field[i] = 1;
  const Eigen::VectorXd force = mass * field;
  const Eigen::VectorXd linear =
      modes.modes * (modes.modes.transpose() * force).cwiseQuotient(modes.eigenvalues);
  const double acceleration =
      sway * body.length() / reduced::largest_node_displacement(linear).maxCoeff();
  // Backward Euler with steps far longer than a swing comes to rest.
  bodies::SimulationOptions settling;
  settling.frame_count = 24;
  settling.steps_per_frame = 1;
  settling.frames_per_second = std::sqrt(modes.eigenvalues[0]) / 3;
  settling.dynamics.scheme = bodies::TimeStepping::kImplicitEuler;
  const bodies::Loads loads{acceleration * Eigen::Vector3d::Unit(axis), {}};
  return {bodies::simulate(body, loads, {}, settling).displacements.rightCols<1>(),
          Eigen::VectorXd::Zero(force.size())};
}

}  // namespace

std::optional<RecoveryScene> recovery_scene(const std::string& name, int frames,
                                            const SuiteOptions& options, double share) {
  const auto folder = std::filesystem::path(options.shared_folder) / "data" / "bodies" / name;
  if (!std::filesystem::exists(folder / "mesh.elastic")) return std::nullopt;
  const auto named = load_body(name, options);
  const bodies::ElasticBody real = with_materials(named->body, name, options);
  RecoveryScene scene;
  scene.name = name;
  scene.generic = named->body;
  scene.generic.mesh.materials = {{1, 0.45, 1}};
  bodies::ModalOptions few;
  few.mode_count = 10;
  const bodies::ModalBasis modes = bodies::modal_analysis(real, few);
  const double omega = std::sqrt(modes.eigenvalues[0]);
  scene.frames_per_second = kFramesPerSwing * omega / kTwoPi;

  bodies::SimulationOptions simulation;
  simulation.frame_count = frames;
  simulation.frames_per_second = scene.frames_per_second;
  simulation.steps_per_frame = 1;
  simulation.dynamics.relaxation_time = 2 * kDampingRatio / omega;
  bodies::Loads loads;
  bodies::DynamicState initial;
  if (name == "beam") {
    loads = push_end(real, scene.frames_per_second, share);
    scene.driven_frames = 2 * kPush;
  } else {
    initial = held_aside(real, modes, share * kStaticSway);
  }
  scene.simulation_ms = milliseconds([&] {
    scene.displacements = bodies::simulate(real, loads, initial, simulation).displacements;
  });
  scene.largest =
      reduced::largest_node_displacement(scene.displacements).maxCoeff() / real.length();
  return scene;
}

}  // namespace limber::bench
