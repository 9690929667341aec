#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "engine/bodies/force_profile.h"
#include "engine/bodies/time_stepping.h"

namespace limber::scene {

/// A force on a group of nodes during some frames, which need not be whole: frame f is the time
/// f / frames_per_second.
struct NodalForce {
  std::vector<int> nodes;             // source node ids, one or more; they share it equally
  Eigen::Vector3d force = {0, 0, 0};  // in all [N]
  double from_frame = 0;              // >= 0
  /// > from_frame; infinity: to the last frame.
  double until_frame = std::numeric_limits<double>::infinity();
  bodies::ForceProfile profile = bodies::ForceProfile::kConstant;
  double period_frames = 0;  // > 0 of kSine, else 0
};

/// Frame 0: sums of the given values; at rest if none is given.
struct InitialState {
  Eigen::VectorXd displacement;  // 3 nodes, 3 * node + axis [scene length unit]; empty: none
  /// Amplitudes of the lowest elastic vibration modes [scene length unit]. Every mode is scaled so
  /// that the node that it moves most moves by 1, its largest component positive.
  std::vector<double> modes;
  Eigen::VectorXd velocity;                     // 3 nodes [scene length unit / s]; empty: none
  Eigen::Vector3d common_velocity = {0, 0, 0};  // of all nodes not fixed [scene length unit / s]
};

/// A motion of the unreduced body (bodies/simulation.h): what acts on it and how time is cut up. It
/// has the frames of its scene.
struct Simulation {
  Eigen::Vector3d gravity = {0, 0, 0};  // [m/s^2]
  std::vector<NodalForce> forces;
  InitialState initial;
  std::optional<double> frames_per_second;  // > 0; absent: those of the scene's dynamics
  int steps_per_frame = 8;                  // in [1, 10000]
  bodies::TimeStepping scheme = bodies::TimeStepping::kImplicitMidpoint;
  double mass_damping = 0;     // [1/s], >= 0
  double relaxation_time = 0;  // [s], >= 0
};

}  // namespace limber::scene
