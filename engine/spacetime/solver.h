#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/spacetime/constraint_errors.h"
#include "engine/spacetime/material.h"
#include "engine/spacetime/problem.h"

namespace limber::spacetime {

enum class SolveStatus {
  kConverged,  // scaled gradient below tolerance, exact constraints met (or rank-deficient: least
               // squares)
  kImproved,   // stopped early (one step asked for): better than before, not converged
  kIterationLimit,
  kStalled,  // no step lowers the energy further although the gradient is above tolerance
  kCancelled,
};

struct SolverOptions {
  double gradient_tolerance =
      1e-8;  // stop when |gradient| <= this * its scale (see SolveReport::gradient), in (0, 1)
  double constraint_tolerance = 1e-8;  // exact constraints: |u - target| / body length, in (0, 1)
  int max_iterations = 200;            // > 0
  double rank_tolerance =
      1e-12;  // exact constraints: pivots below this * the largest count as dependent, in (0, 1e-3]

  void validate() const;
};

/// The course of a solve and the quality of the current motion. Energies are unitless (body
/// lengths, frames).
struct SolveReport : ConstraintErrors {
  SolveStatus status = SolveStatus::kImproved;
  int iterations = 0;
  double force_energy = 0;       // E_f, eq. 17a
  double constraint_energy = 0;  // gamma-weighted E_c over soft constraints, eq. 17b
  double total_energy = 0;
  double gradient =
      0;  // scale-free norm of the gradient (definition in docs of the implementation)
  bool rank_deficient =
      false;  // exact constraints depend on or contradict each other: least-squares answer
  int dependent_rows = 0;
  /// Constraints on positions that the final result misses: soft ones by more than half the body's
  /// length, exact ones by more than a thousandth of it. The worst is first. Empty during a solve.
  std::vector<ConstraintMiss> missed;
  std::string message;  // one sentence for a person when status is not kConverged or rank_deficient
};

/// Kind of a motion given to a solver: an answer to this very problem, which needs no challenge by
/// a cold start, or just a starting point.
enum class Known { kAnswer, kGuess };

/// Keeps the optimum of E_f + sum gamma E_c over z warm while constraints change (z only: Lambda,
/// D, S given).
///
/// Not thread-safe; one owner drives it. All state needed to continue warm is inside.
/// `cold_start()` forgets it.
class Solver {
 public:
  /// @param mixing  S, R x r; empty: the first r coordinates, S = (I, 0)^T
  /// @throws Error{kInvalidArgument} naming the member for sizes, signs, non-finite values, too few
  /// frames.
  Solver(std::shared_ptr<const reduced::Kinematics> kinematics, ModeDynamics dynamics,
         Timeline timeline, SolverOptions options = {}, Eigen::MatrixXd mixing = {});
  ~Solver();
  Solver(Solver&&) noexcept;
  Solver& operator=(Solver&&) noexcept;

  void add(const PositionConstraint& constraint);  // kAlreadyExists, kOutOfRange, kInvalidArgument
  void move(ConstraintId id, const Eigen::Vector3d& target);  // kNotFound, kInvalidArgument
  void replace(const PositionConstraint& constraint);         // same id, anything else may change
  void remove(ConstraintId id);                               // kNotFound
  void add_keyframe(const KeyframeConstraint& keyframe);      // kAlreadyExists, kOutOfRange,
                                                              // kInvalidArgument
  void remove_keyframe(ConstraintId id);                      // kNotFound
  void set_timeline(EndCondition first, EndCondition last);
  void set_dynamics(ModeDynamics dynamics);
  /// Acceleration of the modes, for example by an animated base (passive_motion()): E_f counts only
  /// the control forces. Without constraints the motion is the passive one. It applies to the
  /// current modes, also after others are set. @param load  r x N [1/frame^2]; empty: none
  void set_load(const Eigen::MatrixXd& load);  // kInvalidArgument
  /// Other dynamics and other modes at once, of the same number: the present z is kept, with
  /// a new meaning in them. mixing empty: the first r coordinates. Errors as the constructor's.
  void set_material(Material material);
  [[nodiscard]] std::vector<PositionConstraint> constraints() const;  // ordered by id
  /// All of them with the weights that are solved for.
  [[nodiscard]] ConstraintSet constraint_set() const;
  /// Every soft weight counts this many times, in [1e-12, 1e12]; 1 at first. add() and the like
  /// take and constraints() returns weights without it.
  void set_weight_scale(double scale);
  [[nodiscard]] double weight_scale() const;

  void cold_start();
  /// Takes up another motion, r x N: what motion() was, to return to it. Zero where an end
  /// condition holds it. @throws Error{kInvalidArgument} for another shape or non-finite values
  void warm_start(const Eigen::MatrixXd& motion, Known known);
  /// Whether the result of one solve of this problem is better than that of another: exact
  /// constraints first, then energy. A result that has not converged must be clearly lower.
  [[nodiscard]] bool prefers(const SolveReport& report, const SolveReport& other) const;

  /// The first corrected motion: where only targets changed, one back substitution at the kept
  /// Jacobians; never solves to convergence. Cheap enough to publish at once.
  SolveReport correct();

  /// Iterates to convergence. `on_improved` is called after each accepted iteration (motion() is
  /// valid inside); return false from it to stop with kImproved. It stops so within an iteration,
  /// at the last accepted one, where the kinematics throws Error{kCancelled}; infinite energies say
  /// that those of the motion are not known. Before the first iteration, where a changed set of
  /// constraints is taken up, that error is the caller's.
  SolveReport solve(const JobContext& job = {},
                    const std::function<bool(const SolveReport&)>& on_improved = {});

  /// z, r x N: modal coordinates of every frame at the current iterate.
  [[nodiscard]] const Eigen::MatrixXd& motion() const;
  /// Some columns of motion(), without the others. @param frames  within the motion
  [[nodiscard]] Eigen::MatrixXd motion_in(FrameSpan frames) const;
  /// Frames that motion_in() computes for these: those of the runs between constraints; 0 once the
  /// whole motion is known.
  [[nodiscard]] int frames_to_fill(FrameSpan frames) const;
  [[nodiscard]] const Timeline& timeline() const;
  [[nodiscard]] const ModeDynamics& dynamics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::spacetime
