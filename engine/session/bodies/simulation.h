#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/session.h"

namespace limber::session {

/// How a simulation went.
struct SimulationReport {
  double frames_per_second = 30;
  int steps = 0, newton_steps = 0;
  int shortened_steps = 0;           // of the steps: taken in parts, since Newton failed
  Eigen::VectorXd kinetic, elastic;  // energy at each frame [J]
  Eigen::VectorXd work;              // done by the loads from frame 0 on [J]
  /// Largest |kinetic + elastic - work - (the same in frame 0)| over the frames, relative to the
  /// largest energy. It is the loss by damping (or Euler's scheme), else the error of the scheme.
  double energy_drift = 0;
  double smallest_volume_ratio = 1;  // of a tet to that at rest; below 0: turned inside out
  int smallest_frame = 0, smallest_tet = 0;
  std::string message;  // what the user should know; empty if nothing
};

/// A simulated motion on the mesh as the client sent it.
struct SimulatedMotion {
  Geometry geometry;          // without a basis
  Eigen::MatrixXd positions;  // 3 source nodes x frames, 3 * node + axis [scene units]
  SimulationReport report;
};

/// The simulation of a valid scene (scene::validate), which must have one. Nodes of no tet stay
/// where they are. A base motion is not looked at.
/// @throws Error{kInvalidArgument} naming "simulation" where the scene has none, and what the mesh
/// or the modes of the initial state are refused for; {kNumerical} where a step fails; {kCancelled}
[[nodiscard]] SimulatedMotion simulate(const scene::Scene& scene, const JobContext& job = {});

}  // namespace limber::session
