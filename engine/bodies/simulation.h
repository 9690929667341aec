#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/force_profile.h"
#include "engine/bodies/full_dynamics.h"

namespace limber::bodies {

/// A force that acts for a while, shared equally by its nodes.
struct PointForce {
  std::vector<int> nodes;                                  // compact ids, one or more
  Eigen::Vector3d force = {0, 0, 0};                       // in all [N]
  double from = 0;                                         // [s]
  double until = std::numeric_limits<double>::infinity();  // [s], > from; finite for a ramp
  ForceProfile profile = ForceProfile::kConstant;
  double period = 1;  // [s], > 0; of kSine
};

struct Loads {
  Eigen::Vector3d gravity = {0, 0, 0};  // [m/s^2]
  std::vector<PointForce> forces;
};

struct SimulationOptions {
  int frame_count = 0;            // >= 1; frame 0 is the initial state
  double frames_per_second = 30;  // > 0
  int steps_per_frame = 8;        // >= 1
  DynamicsOptions dynamics;       // its time_step is set from the three above

  /// @throws Error{kInvalidArgument} naming the member, its value and the inequality
  void validate() const;
};

struct Simulation {
  Eigen::MatrixXd displacements;     // 3n x frame_count, ordered 3 * node + axis [m]
  Eigen::VectorXd kinetic, elastic;  // energy at each frame [J]
  Eigen::VectorXd work;              // done by the loads from frame 0 on, at each frame [J]
  int steps = 0, newton_steps = 0;   // taken
  int shortened_steps = 0;           // of the steps: split into parts, since Newton failed
  double smallest_volume_ratio = 1;  // det F over all frames and tets
  int smallest_frame = 0, smallest_tet = 0;
  std::string message;  // a note for the user (tets turned inside out); empty if none
};

/// A motion of the unreduced body (FullDynamics) under loads. A step that Newton's method cannot
/// take is halved, up to ten times.
/// @param initial  displacement and velocity of frame 0; empty vectors: at rest
/// @throws Error{kInvalidArgument}, Error{kOutOfRange} naming the field; Error{kNumerical} naming
/// the time where even the shortest step failed; Error{kCancelled}
[[nodiscard]] Simulation simulate(const ElasticBody& body, const Loads& loads,
                                  const DynamicState& initial, const SimulationOptions& options,
                                  const JobContext& job = {});

}  // namespace limber::bodies
