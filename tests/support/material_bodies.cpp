#include "tests/support/material_bodies.h"

#include <algorithm>
#include <fstream>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/session/bodies/session.h"
#include "engine/spacetime/motion_spectrum.h"

namespace limber::testing {

using Eigen::Index;
using session::BodyResult;

namespace {

constexpr int kFrames = 200, kTargets = 3, kFrameOfTarget = 50;
constexpr double kNearestTarget = 0.1, kFarthestTarget = 0.3;  // body lengths
constexpr double kPoseReach = 0.2;  // largest displacement of a keyframe [body lengths]
constexpr std::uint64_t kSeed = 24;

std::vector<int> used_nodes(const bodies::TetMesh& mesh) {
  std::vector<int> nodes(mesh.tets.data(), mesh.tets.data() + mesh.tets.size());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

}  // namespace

std::vector<int> lowest_nodes(const bodies::TetMesh& mesh) {
  const std::vector<int> used = used_nodes(mesh);
  const Eigen::VectorXd heights = mesh.nodes.row(1)(used);
  const double limit = heights.minCoeff() + 0.05 * (heights.maxCoeff() - heights.minCoeff());
  std::vector<int> nodes;
  for (const int node : used) {
    if (mesh.nodes(1, node) <= limit) nodes.push_back(node);
  }
  return nodes;
}

std::vector<int> far_nodes(const scene::Scene& scene, int count) {
  const std::vector<int> used = used_nodes(scene.mesh);
  const Eigen::Matrix3Xd places = scene.mesh.nodes(Eigen::all, used);
  Eigen::VectorXd distance =
      Eigen::VectorXd::Constant(places.cols(), std::numeric_limits<double>::infinity());
  const auto keep_away = [&](const Eigen::Vector3d& place) {
    distance =
        distance.cwiseMin((places.colwise() - place).colwise().squaredNorm().transpose().eval());
  };
  for (const int node : scene.fixed_nodes) keep_away(scene.mesh.nodes.col(node));
  if (scene.fixed_nodes.empty()) keep_away(places.rowwise().mean());
  std::vector<int> chosen;
  while (static_cast<int>(chosen.size()) < count) {
    Index best = 0;
    distance.maxCoeff(&best);
    chosen.push_back(used[static_cast<std::size_t>(best)]);
    keep_away(places.col(best));
  }
  return chosen;
}

namespace {

/// The largest extent of the box around the body, as ReducedModel::length.
double body_length(const bodies::TetMesh& mesh) {
  const Eigen::Matrix3Xd nodes = mesh.nodes(Eigen::all, used_nodes(mesh));
  return (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).maxCoeff();
}

void add_constraints(scene::Scene& scene) {
  Random random(kSeed);
  const double length = body_length(scene.mesh);
  int frame = 0;
  for (const int node : far_nodes(scene, kTargets)) {
    scene::Constraint constraint;
    constraint.frame = frame += kFrameOfTarget;
    constraint.nodes = {node};
    Eigen::Vector3d direction;
    for (double& value : direction) value = random.normal();
    constraint.target =
        random.uniform(kNearestTarget, kFarthestTarget) * length * direction.normalized();
    scene.constraints.push_back(constraint);
  }
}

class Results final : public session::BodyListener {
 public:
  void on_progress(const session::Progress& /*progress*/) override {}
  void on_state(session::State /*state*/, const std::string& /*message*/) override {}
  void on_result(const std::shared_ptr<const BodyResult>& result) override {
    all.push_back(result);
  }
  std::vector<std::shared_ptr<const BodyResult>> all;
};

/// A session that has solved and checked its scene when its constructor returns.
struct Solved {
  Solved(scene::Scene scene, const std::shared_ptr<session::ModelCache>& cache)
      : session(
            "motion", std::move(scene), {}, cache,
            [](const std::function<void()>& task) { task(); }, results) {
    if (session.state() != session::State::kReady)
      throw Error(ErrorCode::kInternal, "", session.state_message());
    if (results->all.empty() || results->all.back()->solve_failed)
      throw Error(ErrorCode::kNumerical, "", "the solve failed");
  }
  [[nodiscard]] Eigen::MatrixXd positions(const BodyResult& result) const {
    return session.positions(result, 0, static_cast<int>(result.modal.cols()));
  }

  std::shared_ptr<Results> results = std::make_shared<Results>();
  session::BodySession session;
};

void add_keyframes(scene::Scene& scene, const std::shared_ptr<session::ModelCache>& cache) {
  scene::Scene led = scene;
  add_constraints(led);
  // With as many candidate modes, so that the model is the same one.
  led.model.candidate_modes = scene::ModelRequest::kDefaultCandidates;
  led.material_optimisation.variables = scene::MaterialVariables::kMotion;
  const Solved motion(led, cache);
  const Eigen::MatrixXd positions = motion.positions(*motion.results->all.back());
  const double length = body_length(scene.mesh);
  for (int i = 1; i <= kTargets; ++i) {
    scene::Keyframe keyframe;
    keyframe.frame = i * kFrameOfTarget;
    Eigen::VectorXd pose =
        positions.col(keyframe.frame) - motion.session.geometry()->rest.reshaped();
    pose *= kPoseReach * length / pose.reshaped(3, pose.size() / 3).colwise().norm().maxCoeff();
    keyframe.pose = std::make_shared<const Eigen::VectorXd>(std::move(pose));
    scene.keyframes.push_back(keyframe);
  }
}

struct Step {
  double distance = 0;  // [scene units]
  int frame = 0;        // after which
};

Step largest_step(const Eigen::MatrixXd& positions) {
  Step largest;
  for (Index i = 0; i + 1 < positions.cols(); ++i) {
    const Eigen::VectorXd step = positions.col(i + 1) - positions.col(i);
    const double distance = step.reshaped(3, step.size() / 3).colwise().norm().maxCoeff();
    if (distance > largest.distance) largest = {distance, static_cast<int>(i)};
  }
  return largest;
}

std::string status_name(spacetime::SolveStatus status) {
  switch (status) {
    case spacetime::SolveStatus::kConverged:
      return "converged";
    case spacetime::SolveStatus::kImproved:
      return "improved";
    case spacetime::SolveStatus::kIterationLimit:
      return "iteration limit";
    case spacetime::SolveStatus::kStalled:
      return "stalled";
    case spacetime::SolveStatus::kCancelled:
      return "cancelled";
  }
  return {};
}

}  // namespace

std::vector<int> read_node_list(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::size_t count = 0;
  file >> count;
  std::vector<int> nodes;
  for (int node = 0; nodes.size() < count && file >> node;) nodes.push_back(node);
  return nodes;
}

const std::vector<BodyFile>& public_bodies() {
  static const std::vector<BodyFile> files = {
      {"liver", "liver.msh", {}},
      {"turtle", "turtle-volumetric-heterogeneous.veg", {}},
      {"mushroom", "mushroom.abq", {}},
      {"fish", "fish.abq", {}},
      {"public dino", "dino/mesh.abq", "dino/con_nodes.bou"},
      {"frog", "frog.mesh", {}},
      {"public beam", "beam/mesh.abq", "beam/con_nodes.bou"},
      {"tyrannosaurus", "tyrannosaurus/mesh.abq", "tyrannosaurus/con_nodes.bou"},
      {"raptor", "raptorTetra_8418.vtu", {}},
      {"cactus", "cactus_test_3.node", {}},
      {"ditto", "ditto.vtk", {}},
      {"octopus", "octopus.abq", {}},
      {"bunny", "bunny.msh", {}},
      {"dolphin", "dolphin5K.msh", {}},
      {"armadillo", "Armadillo13K.msh", {}},
      {"beam-fine", "beam-fine.abq", {}}};
  return files;
}

std::optional<scene::Scene> read_body(const BodyFile& file, const std::filesystem::path& bodies) {
  if (!std::filesystem::exists(bodies / file.mesh)) return std::nullopt;
  scene::Scene scene;
  scene.name = file.name;
  scene.mesh = scene::read_mesh_file(bodies / file.mesh).mesh;
  scene.fixed_nodes = file.fixed_nodes.empty() ? lowest_nodes(scene.mesh)
                                               : read_node_list(bodies / file.fixed_nodes);
  return scene;
}

std::string name_of(BodyTask task) {
  switch (task) {
    case BodyTask::kConstraints:
      return "constraints";
    case BodyTask::kLastEndFree:
      return "last end free";
    case BodyTask::kBothEndsFree:
      return "both ends free";
    case BodyTask::kFreeBody:
      return "free body";
    case BodyTask::kKeyframes:
      return "keyframes";
  }
  return {};
}

scene::Scene with_task(scene::Scene scene, BodyTask task,
                       const std::shared_ptr<session::ModelCache>& cache) {
  scene::Scene result;
  result.name = scene.name;
  result.mesh = std::move(scene.mesh);
  result.material = scene.material;
  result.merge_tolerance = scene.merge_tolerance;
  result.frame_count = kFrames;
  if (task != BodyTask::kFreeBody) result.fixed_nodes = std::move(scene.fixed_nodes);
  if (task == BodyTask::kBothEndsFree) result.first_end = scene::End::kFree;
  if (task == BodyTask::kBothEndsFree || task == BodyTask::kLastEndFree)
    result.last_end = scene::End::kFree;
  if (task == BodyTask::kKeyframes) {
    add_keyframes(result, cache);
  } else {
    add_constraints(result);
  }
  return result;
}

FittedMotion fit_motion(scene::Scene scene, const std::shared_ptr<session::ModelCache>& cache) {
  scene.material_optimisation.variables = scene::MaterialVariables::kAll;
  const double length = body_length(scene.mesh);
  const Solved solved(scene, cache);
  const auto& results = solved.results->all;
  const BodyResult& final = *results.back();
  std::shared_ptr<const BodyResult> before;  // the newest of forces alone
  FittedMotion motion;
  for (const auto& result : results) {
    if (result->material_iterations == 0 && !result->is_final) {
      before = result;
      continue;
    }
    if (result->check == session::Check::kDone) continue;  // the final one again, with its check
    ++motion.published;
    if (result->report.total_energy > before->report.total_energy) ++motion.published_above_start;
  }
  const auto model = solved.session.model();
  const Eigen::VectorXd sizes = model->modes.colwise().norm();
  motion.tets = static_cast<int>(solved.session.geometry()->tets.cols());
  motion.high_frequency_share_forces = spacetime::high_frequency_share(
      sizes.asDiagonal() * (before->material->mixing * before->modal));
  motion.high_frequency_share = final.high_frequency_share;
  motion.largest_step_forces = largest_step(solved.positions(*before)).distance / length;
  const Step step = largest_step(solved.positions(final));
  motion.largest_step = step.distance / length;
  motion.largest_step_frame = step.frame;
  motion.energy_forces = before->report.total_energy;
  motion.energy = final.report.total_energy;
  if (final.motion_check) {
    motion.shape_error = final.motion_check->error.shape_error;
    motion.inverted_tets = final.motion_check->error.inverted_tets;
  }
  motion.status = status_name(final.report.status);
  motion.message = final.report.message;
  return motion;
}

}  // namespace limber::testing
