#pragma once

#include <functional>
#include <map>
#include <memory>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"
#include "engine/spacetime/newton_step.h"
#include "engine/spacetime/solver.h"

namespace limber::spacetime {

/// The iteration over z at the kept frames. Everything it keeps is valid between calls; edits come
/// in through set_structure() and target_moved().
class Optimizer {
 public:
  Optimizer(std::shared_ptr<const reduced::Kinematics> kinematics, const ModeDynamics& dynamics,
            const Timeline& timeline, const SolverOptions& options, Eigen::MatrixXd mixing);

  /// The set of constraints changed in more than a target: frames, sites, axes or weights.
  void set_structure(const std::map<ConstraintId, PositionConstraint>& constraints);
  void target_moved(const PositionConstraint& constraint);
  /// Other dynamics or ends: the present motion is kept where they allow it.
  void set_systems(const ModeDynamics& dynamics, const Timeline& timeline,
                   const std::map<ConstraintId, PositionConstraint>& constraints);
  void cold_start();

  SolveReport correct();
  SolveReport solve(const JobContext& job,
                    const std::function<bool(const SolveReport&)>& on_improved);

  [[nodiscard]] const Eigen::MatrixXd& motion() const;

 private:
  enum class Progress { kAccepted, kNoDecrease };

  void evaluate(const Lanes& z, ConstraintRows::Jacobian wanted, RowState& state) const;
  [[nodiscard]] double merit(const Lanes& z, const RowState& state) const;
  [[nodiscard]] double scaled(double decrement2) const;
  [[nodiscard]] double max_exact(const Eigen::VectorXd& residual) const;
  [[nodiscard]] Progress search(const Step& step, ConstraintRows::Jacobian wanted, double& taken);
  void accept(const Step& step, double taken);
  void add_curvature(const Eigen::VectorXd& m, const Lanes& d, Lanes& out);
  [[nodiscard]] SolveReport report(SolveStatus status, int iterations, double gradient) const;
  void say_rank(SolveReport& report) const;
  /// Whether no step can lower the exact rows' errors further to first order: all that is left is
  /// contradiction.
  [[nodiscard]] bool only_contradiction_left() const;

  SolverOptions options_;
  double length_;
  ModeSystems systems_;
  ConstraintRows rows_;
  ConstraintSpace space_;
  Lanes z_;         // at the kept frames
  RowState state_;  // at z_
  bool residual_valid_ = false, jacobian_valid_ = false;
  Step step_;
  Lanes trial_, force_, probe_z_;
  mutable Lanes knots_z_;
  RowState trial_state_, probe_state_;
  Eigen::VectorXd shifted_, multiplier_;
  mutable Eigen::MatrixXd motion_;
  mutable bool motion_valid_ = false;
};

}  // namespace limber::spacetime
