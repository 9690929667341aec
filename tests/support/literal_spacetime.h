#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/spacetime/problem.h"
#include "engine/spacetime/solver.h"

namespace limber::testing {

/// The paper's own method to optimise z (space-time editing, section 5.3), written plainly: all z
/// stacked in one vector, H_z = H_f + gamma J^T J assembled as one sparse matrix (21), CHOLMOD for
/// the steps (symbolic analysis once, numeric factor every iteration), Gauss-Newton with step
/// halving. Baseline of the benchmark, reference of the tests. Soft constraints only.
///
/// Plain, but not slowed down: H_f and the pattern of H_z are made once, an iteration only writes
/// the values of constrained blocks; the first trial of a step brings its Jacobian along.
struct LiteralResult {
  Eigen::MatrixXd z;  // r x N
  int iterations = 0;
  double force_energy = 0, constraint_energy = 0, total_energy = 0;
  double gradient = 0;  // as SolveReport::gradient
  bool converged = false;
  /// Of each accepted iteration (at full weights), and the time since the call when it was there.
  std::vector<double> energies, milliseconds;
};

class LiteralSpacetime {
 public:
  LiteralSpacetime(std::shared_ptr<const reduced::Kinematics> kinematics,
                   spacetime::ModeDynamics dynamics, spacetime::Timeline timeline,
                   std::vector<spacetime::PositionConstraint> constraints,
                   spacetime::SolverOptions options = {});
  ~LiteralSpacetime();

  /// From z = 0 to convergence, as the paper does it.
  LiteralResult solve_cold();
  /// From z = 0 too, but with all weights scaled by 1e-5, then 1e-4, ... up to 1: three steps each,
  /// the last stage to convergence. Where z = 0 at full weight ends in a worse minimum, this is the
  /// method to compare with: it is led to the same basin as limber's own cold start.
  LiteralResult solve_continued();
  /// From any motion (r x N; pinned frames are set to 0) to convergence.
  LiteralResult solve_from(const Eigen::MatrixXd& start);
  /// E_f and sum gamma E_c of any motion, straight from eqs. 17a and 17b.
  [[nodiscard]] double force_energy(const Eigen::MatrixXd& z) const;
  [[nodiscard]] double constraint_energy(const Eigen::MatrixXd& z) const;
  /// d (E_f + sum gamma E_c) / d z, r x N; zero in pinned frames.
  [[nodiscard]] Eigen::MatrixXd gradient(const Eigen::MatrixXd& z) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::testing
