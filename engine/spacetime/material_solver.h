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
  // in long flat valleys: the energy keeps falling slowly for hundreds of steps.
  double tolerance = 1e-4;
  int max_iterations = 300;  // > 0
  // Highest frequency of a mode [1/frame], in (0, 1/2]: lambda <= stiffness_of(max_frequency).
  // If swings of few frames are allowed, E_f is small for motions that shake, since the step of its
  // differences is the frame. Damping ratios of sampled modes have bounds, too (FitOptions).
  double max_frequency = 1.0 / 8;
  // The first steps keep all frequencies below slow_frequency, the others below max_frequency. From
  // slow modes they reach lower energies and slower motions than from stiff ones. >= 0
  int slow_steps = 10;
  double slow_frequency = kSlowestNeeded;  // [1/frame], in (0, 1/2]
  int held = 0;  // first modes whose dynamics and columns stay: rigid unknowns of a free body
  /// E_f does not bound the size of free swings. Steps to motions whose size is above `most` and
  /// above the size before the step are refused; without `size` none are.
  struct MotionLimit {
    std::function<double(const Eigen::MatrixXd& mixing, const Eigen::MatrixXd& motion)> size;
    double most = 0;
  };
  MotionLimit limit = {};

  /// See slow_frequency_of().
  static constexpr double kSlowestNeeded = 1.0 / 24;

  void validate() const;
};

/// Frequency [1/frame] of the slow steps of a fit that starts with these dynamics: that of the
/// lowest elastic mode that is not a mechanism's, at most kSlowestNeeded.
/// @param held  modes before it: rigid unknowns and mechanisms
[[nodiscard]] double slow_frequency_of(const ModeDynamics& dynamics, int held);

/// Energies are unitless (body lengths, frames).
struct MaterialReport : ConstraintErrors {
  // kConverged: the energy has settled (MaterialOptions::tolerance); lower ones may well exist.
  SolveStatus status = SolveStatus::kImproved;
  int iterations = 0;       // accepted steps
  int evaluations = 0;      // of u and J, refused trials included
  double force_energy = 0;  // E_f
  double unit_force_energy =
      0;  // unit_force_energy(): comparable between materials; 0 while it runs
  double constraint_energy = 0;  // gamma E_c over soft constraints
  double column_energy = 0;      // mu E_s
  double total_energy = 0;       // their sum
  // Lower than the start of the solve, errors of exact rows weighted. Steps in between may not be:
  // bounds raise the energy first.
  bool below_start = false;
  std::string message;  // one sentence for a person when status is not kConverged
};

/// Minimises E_f + sum gamma E_c + mu E_s over z, Lambda, D and S (paper: space-time editing, eq.
/// 19). One iteration changes all of them. It takes a Gauss-Newton step in (z, S) through the
/// constraints' rows (MaterialSpace), then the exact best (lambda_k, d_k) of each mode
/// (fit_dynamics.h). Starts from any motion; best from the answer of a Solver with the material it
/// starts from.
///
/// Frequencies above the bounds of MaterialOptions are lowered to them before the first step. This
/// raises the energy, also if S mixes soft shapes into modes that were stiff. Local minima are
/// many: if the steps end no lower than the start, the start is the answer, with its frequencies
/// above the bounds. If the first ten steps gain less than the tolerance, it is the answer too, so
/// that a settled material is not changed.
class MaterialSolver {
 public:
  static constexpr int kMaxRows = 2048;  // a step factors a dense matrix of this size

  /// @param motion  z, r x N
  /// @throws Error{kInvalidArgument} naming the member for sizes, signs and non-finite values,
  /// Error{kLimitExceeded} for more than kMaxRows rows of constraints
  MaterialSolver(std::shared_ptr<const reduced::Kinematics> kinematics, Timeline timeline,
                 const ConstraintSet& constraints, Material material, const Eigen::MatrixXd& motion,
                 MaterialOptions options = {});
  ~MaterialSolver();
  MaterialSolver(MaterialSolver&&) noexcept;
  MaterialSolver& operator=(MaterialSolver&&) noexcept;

  /// Iterates to convergence. `on_step` is called after each accepted step. motion() and material()
  /// are valid inside it, and may still be above the start (MaterialReport::below_start). Return
  /// false from it to stop there with kImproved. All other ends are at most as high as the start.
  MaterialReport solve(const JobContext& job = {},
                       const std::function<bool(const MaterialReport&)>& on_step = {});
  /// Makes the next solve() take its steps from here, where an earlier one was stopped, and not
  /// from its start. Errors as the constructor's.
  void resume(const Material& material, const Eigen::MatrixXd& motion);

  [[nodiscard]] const Eigen::MatrixXd& motion() const;  // z, r x N
  [[nodiscard]] const Material& material() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::spacetime
