#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/spacetime/material.h"
#include "engine/spacetime/solver.h"

namespace limber::spacetime {

struct MaterialOptions {
  MaterialVariables variables = MaterialVariables::kAll;
  // mu >= 0, weight of E_s (eq. 20) that keeps the columns of S near unit norm. The paper's 1e-8
  // goes with gamma = 1e-6; it is this ratio, 1e-2, times the default weight 100 of constraints.
  double column_weight = 1;
  // Ends when ten steps lower the energy by less than this part of it, in (0, 1). Material moves
  // in long flat valleys: the energy goes on falling slowly for hundreds of steps.
  double tolerance = 1e-4;
  int max_iterations = 300;  // > 0
  int held = 0;  // first modes whose dynamics and columns stay: rigid unknowns of a free body

  void validate() const;
};

/// Energies are unitless (body lengths, frames).
struct MaterialReport {
  // kConverged: the energy has settled (MaterialOptions::tolerance); lower ones may well exist.
  SolveStatus status = SolveStatus::kImproved;
  int iterations = 0;            // accepted steps
  int evaluations = 0;           // of u and J, refused trials included
  double force_energy = 0;       // E_f
  double unit_force_energy = 0;  // unit_force_energy(): comparable between materials; 0 on the way
  double constraint_energy = 0;  // gamma E_c over soft constraints
  double column_energy = 0;      // mu E_s
  double total_energy = 0;       // their sum
  double max_constraint_error = 0, rms_constraint_error = 0;  // as SolveReport [m]
  double max_exact_error = 0;                                 // as SolveReport [m]
  double max_keyframe_error = 0;                              // as SolveReport
  std::string message;  // one sentence for a person when status is not kConverged
};

/// Minimises E_f + sum gamma E_c + mu E_s over z, Lambda, D and S (paper: space-time editing, eq.
/// 19), all within one iteration: a Gauss-Newton step in (z, S) through the constraints' rows
/// (MaterialSpace), then the exact best (lambda_k, d_k) of each mode (fit_dynamics.h). Starts from
/// any motion; best from the answer of a Solver with the material it starts from.
///
/// Local minima are many: what it finds is never worse than where it starts. Where ten steps gain
/// less than the tolerance it stays at the start, so that a settled answer is left as it is.
class MaterialSolver {
 public:
  static constexpr int kMostRows = 2048;  // a step factors a dense matrix of this size

  /// @param motion  z, r x N
  /// @throws Error{kInvalidArgument} naming the member for sizes, signs and non-finite values,
  /// Error{kLimitExceeded} for more than kMostRows rows of constraints
  MaterialSolver(std::shared_ptr<const reduced::Kinematics> kinematics, Timeline timeline,
                 const ConstraintSet& constraints, Material material, const Eigen::MatrixXd& motion,
                 MaterialOptions options = {});
  ~MaterialSolver();
  MaterialSolver(MaterialSolver&&) noexcept;
  MaterialSolver& operator=(MaterialSolver&&) noexcept;

  /// Iterates to convergence. `on_improved` is called after each accepted step (motion() and
  /// material() are valid inside); return false from it to stop with kImproved.
  MaterialReport solve(const JobContext& job = {},
                       const std::function<bool(const MaterialReport&)>& on_improved = {});

  [[nodiscard]] const Eigen::MatrixXd& motion() const;  // z, r x N
  [[nodiscard]] const Material& material() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::spacetime
