#include "server/kinds/bodies/memory_estimate.h"

#include <algorithm>
#include <cmath>

#include "engine/spacetime/material_solver.h"
#include "server/kinds/bodies/carried_surface.h"

namespace limber::server {

/// A velocity reads two frames, as two constraints do; a path all of its own.
std::size_t constraints_of(const scene::Scene& scene) {
  std::size_t count = scene.constraints.size();
  for (const scene::Constraint& constraint : scene.constraints) {
    if (constraint.kind == scene::TargetKind::kVelocity) ++count;
    count += static_cast<std::size_t>(std::max(0, constraint.last_frame() - constraint.frame));
  }
  return count;
}

std::uint64_t estimate_session_bytes(const scene::Scene& scene) {
  return estimate_session_bytes(scene, scene.model);
}

std::uint64_t estimate_session_bytes(const scene::Scene& scene, const scene::ModelRequest& model) {
  const double n = scene.mesh.node_count(), m = scene.mesh.tet_count(), frames = scene.frame_count;
  const int candidates = std::max(scene::candidate_mode_count(scene), model.mode_count);
  const double r = candidates + 6.0;
  const double h = model.basis_size > 0 ? model.basis_size : 8 * r;
  const double poses = 500 + 20 * r;   // training, test and mode-aligned poses, with room
  double numbers = 3 * n * poses;      // snapshots of u
  numbers += 3 * n * (2 * r + 2 * h);  // modes, Lanczos vectors, basis and its candidates
  numbers += 3 * n * 60 *
             std::cbrt(std::max(1.0, n));  // Cholesky factor of a 3D body under nested dissection
  numbers += m * (9 * 12 + 9 * r + 64);    // gradient operator, RS modes, elements
  numbers += 3 * n * frames * (scene.base_motion.size() > 0 ? 2 : 0);
  numbers += 4 * frames * (r + h);  // newest, newest final, the solver's own
  return static_cast<std::uint64_t>(numbers * sizeof(double)) +
         (scene.surface ? estimate_surface_bytes(*scene.surface) : 0) +
         estimate_constraint_bytes(constraints_of(scene), model.mode_count) +
         estimate_keyframe_bytes(scene.keyframes.size(), candidates + 6, constraints_of(scene),
                                 model.mode_count) +
         estimate_pose_bytes(scene.keyframes.size(), scene.mesh.node_count(),
                             scene.mesh.tet_count());
}

/// As the scene has it and in SI units, and once more while it is made.
std::uint64_t estimate_base_motion_bytes(const scene::Scene& scene) {
  if (scene.base_motion.size() > 0) return 0;
  return static_cast<std::uint64_t>(3.0 * scene.mesh.node_count() * scene.frame_count * 3 *
                                    sizeof(double));
}

std::uint64_t estimate_kept_bytes(const scene::Scene& scene) {
  const double n = scene.mesh.node_count(), m = scene.mesh.tet_count(), frames = scene.frame_count;
  const int candidates = scene::candidate_mode_count(scene);
  const double r = candidates + 6.0;
  const double h = scene.model.basis_size > 0 ? scene.model.basis_size : 4 * r;
  double numbers = 2 * 3 * n * (r + h);  // modes and basis, of the model and of the full map
  numbers += 3 * n * 40 * std::cbrt(std::max(1.0, n));
  numbers += 2 * m * (9 * 12 + 9 * r + 64);
  numbers += 3 * n * frames * (scene.base_motion.size() > 0 ? 2 : 0);
  numbers += 4 * frames * (r + h);
  return static_cast<std::uint64_t>(numbers * sizeof(double)) +
         (scene.surface ? estimate_surface_bytes(*scene.surface) : 0) +
         estimate_constraint_bytes(constraints_of(scene), scene.model.mode_count) +
         estimate_keyframe_bytes(scene.keyframes.size(), candidates + 6, constraints_of(scene),
                                 scene.model.mode_count) +
         estimate_pose_bytes(scene.keyframes.size(), scene.mesh.node_count(),
                             scene.mesh.tet_count());
}

std::uint64_t estimate_simulation_bytes(const scene::Scene& scene) {
  const double n = scene.mesh.node_count(), m = scene.mesh.tet_count(), frames = scene.frame_count;
  double numbers = 3 * n * 60 * std::cbrt(std::max(1.0, n));  // Cholesky factor of a step
  numbers += 3 * n * 3 * 45;        // mass, second derivative, its free part
  numbers += m * (9 * 12 + 64);     // gradient operator, elements
  numbers += 3 * n * frames * 2.5;  // displacements; positions, and a part to be sent
  if (scene.simulation)             // modes of the initial state and Lanczos vectors
    numbers += 3 * n * 4 * static_cast<double>(scene.simulation->initial.modes.size());
  return static_cast<std::uint64_t>(numbers * sizeof(double));
}

std::uint64_t estimate_recovery_bytes(const scene::Scene& scene, int total_frames) {
  const double n = scene.mesh.node_count(), m = scene.mesh.tet_count(), frames = scene.frame_count;
  const double total = total_frames, r = scene.model.mode_count;
  const double requested = scene.model.candidate_modes > 0
                               ? scene.model.candidate_modes
                               : scene::ModelRequest::kDefaultCandidates;
  const double candidates = std::max(r, requested) + 6;
  double numbers = 3 * n * 60 * std::cbrt(std::max(1.0, n));  // Cholesky factor of the stiffness
  numbers += 3 * n * candidates * 6;                          // modes, scaled ones, Lanczos vectors
  numbers += m * (9 * 12 + 64) + 2 * 9 * m;                   // gradient operator, elements, a pose
  numbers += 3 * n * (2 * frames + 1.5 * total + 3 * 64);  // base motion twice, positions, shapes
  numbers += candidates * 4 * (frames + total);
  // The band of z, cross terms by chunks on each core, and the coupling of up to 32 modes.
  numbers += r * frames * (2 * r + 4 * 64) + 2 * std::pow(std::min(r, 32.0), 4);
  return static_cast<std::uint64_t>(numbers * sizeof(double));
}

int keyframe_rows(const scene::Scene& scene) { return scene::candidate_mode_count(scene) + 6; }

std::uint64_t estimate_pose_bytes(std::size_t keyframes, int nodes, int tets) {
  const auto n = static_cast<std::uint64_t>(nodes), m = static_cast<std::uint64_t>(tets);
  // The pose itself, that of the scene and the mapped one; and its part beyond the modes.
  return keyframes * (3 * 3 * sizeof(double) * n + 9 * sizeof(float) * m);
}

std::uint64_t estimate_constraint_bytes(std::size_t constraints, int modes) {
  const auto c = static_cast<double>(constraints);
  const double r = modes + 6.0;
  double numbers = 2 * (3 * c) * (3 * c);  // the system of three rows each, and its factor
  numbers += c * c / 2 * r;                // responses between constrained frames
  numbers += 3 * c * 6 * r;                // Jacobians, sites
  numbers += 3 * c * 4 * r * r;            // the second-order model at three kept frames each
  return static_cast<std::uint64_t>(numbers * sizeof(double));
}

std::uint64_t estimate_keyframe_bytes(std::size_t keyframes, int rows_each, std::size_t constraints,
                                      int modes) {
  const auto k = static_cast<double>(keyframes), c = static_cast<double>(constraints);
  if (keyframes == 0) return 0;
  const double r = modes + 6.0, rows = k * rows_each;
  const double solvers = 2;                            // the second one challenges the answer
  double numbers = solvers * rows * 4 * r;             // Jacobians of iterate, trials and factor
  numbers += solvers * k * 2 * 2 * (2 * r) * (2 * r);  // two block systems, two kept frames each
  numbers += solvers * 2 * k * r * 3 * c;  // responses of the kept frames to constraints
  // Material optimisation keeps all rows in one dense system, as long as it takes them.
  const double dense = std::min<double>(spacetime::MaterialSolver::kMaxRows, rows + 3 * c);
  numbers += 4 * dense * dense + (k + c) * (k + c) / 2 * r;
  return static_cast<std::uint64_t>(numbers * sizeof(double));
}

}  // namespace limber::server
