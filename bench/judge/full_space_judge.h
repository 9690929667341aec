#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/bodies/elastic_body.h"
#include "engine/spacetime/problem.h"

namespace limber::bench {

/// A soft constraint on a node: weight / 2 |(u(frame) - target) / length|^2.
struct JudgedTarget {
  int node = 0;  // compact
  int frame = 0;
  Eigen::Vector3d target = {0, 0, 0};  // displacement from rest [m]
  double weight = 100;
};

struct JudgedProblem {
  bodies::ElasticBody body;  // held
  Eigen::MatrixXd modes;     // W-hat, 3n x r [m]
  double length = 0;         // [m]
  spacetime::ModeDynamics dynamics;
  int frame_count = 0;  // the first two and the last two frames are at rest
  std::vector<JudgedTarget> targets;
};

struct Judgement {
  double energy = 0;
  double max_miss = 0;  // of targets [m]
  int steps = 0;
  bool settled = false;    // the last step promised less than 1e-12 of the energy
  Eigen::MatrixXd motion;  // z, r x N
};

/// Control forces plus constraints (space-time editing, eq. 17) with the full rotation-strain map,
/// written plainly as the judge of the engine's answers. All frames and modes are unknowns, K of
/// each mode is a dense matrix, and u of a node is the solution of the whole Laplacian. Its
/// Jacobian goes tet by tet with the derivative of the rotation; steps are Gauss-Newton's with
/// halving. It shares with the engine the mesh's gradients and nothing else.
/// @param start  z, r x N: the optimum of the basin that it lies in is found
/// @param max_steps  0: only evaluates the start
[[nodiscard]] Judgement judge(const JudgedProblem& problem, const Eigen::MatrixXd& start,
                              int max_steps);

}  // namespace limber::bench
