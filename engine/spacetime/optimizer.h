#pragma once

#include <functional>
#include <map>
#include <memory>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"
#include "engine/spacetime/newton_step.h"
#include "engine/spacetime/newton_system.h"
#include "engine/spacetime/passive_motion.h"
#include "engine/spacetime/row_products.h"
#include "engine/spacetime/solver.h"

namespace limber::spacetime {

/// The iteration over z at the kept frames. Everything it keeps is valid between calls; edits come
/// in through set_structure(), target_moved(), set_systems(), set_material(), cold_start() and
/// warm_start().
class Optimizer {
 public:
  Optimizer(std::shared_ptr<const reduced::Kinematics> kinematics, const ModeDynamics& dynamics,
            const Timeline& timeline, const SolverOptions& options, Eigen::MatrixXd mixing);

  /// The set of constraints changed in more than a target: frames, sites, axes or weights.
  void set_structure(const ConstraintSet& constraints);
  /// @param from  its target before
  void target_moved(const PositionConstraint& constraint, const Eigen::Vector3d& from);
  /// Other dynamics or ends: the present motion is kept where they allow it.
  void set_systems(const ModeDynamics& dynamics, const Timeline& timeline,
                   const ConstraintSet& constraints);
  /// As set_systems(), with other modes: S, R x r; empty: (I, 0)^T.
  void set_material(const ModeDynamics& dynamics, Eigen::MatrixXd mixing, const Timeline& timeline,
                    const ConstraintSet& constraints);
  /// Accelerations of the modes by an animated base, r x N; empty: none (passive_motion()).
  void set_load(Eigen::MatrixXd load, const ModeDynamics& dynamics, const Timeline& timeline,
                const ConstraintSet& constraints);
  void cold_start();
  void warm_start(const Eigen::MatrixXd& motion, Known known);

  SolveReport correct();
  SolveReport solve(const JobContext& job,
                    const std::function<bool(const SolveReport&)>& on_improved);

  [[nodiscard]] const Eigen::MatrixXd& motion() const;
  [[nodiscard]] Eigen::MatrixXd motion_in(FrameSpan frames) const;
  [[nodiscard]] int frames_to_fill(FrameSpan frames) const {
    return motion_valid_ ? 0 : systems_.frames_to_fill(frames);
  }
  [[nodiscard]] bool beats(const SolveReport& other, const SolveReport& answer) const;

 private:
  /// What became of a step.
  struct Search {
    double taken = 0;   // part of it that trial_ takes; 0: no part lowers the merit
    double before = 0;  // merit where it began
    double gain = 0;    // decrease over what the quadratic model promised
  };
  enum class Curvature { kOwn, kLent };  // of this iterate, or still of an earlier one
  enum class StepKind { kGaussNewton, kNewton, kTruncated };
  enum class Outcome { kMoved, kAgain, kConverged, kStalled };
  /// State of one run of the iteration from step to step.
  struct Course {
    double gradient = 0, previous = 0;  // scaled decrement now; decrement of the step before
    double exact_before = 0;            // largest error of an exact row before the last full step
    int short_steps = 0;
    bool newton = false, ramped = false;
  };

  /// z_ <- the z of a motion, minus its passive part.
  void take_up(const Eigen::MatrixXd& motion);
  /// knots_z_ <- the whole motion at the knots.
  void gather_knots(const Lanes& z) const;
  void evaluate(const Lanes& z, ConstraintRows::Jacobian jacobian, RowState& state) const;
  /// Residuals, Jacobians, force and shifted residuals at z_.
  void linearise();
  [[nodiscard]] double merit(const Lanes& z, const RowState& state) const;
  [[nodiscard]] double scaled(double decrement2) const;
  [[nodiscard]] double max_exact(const Eigen::VectorXd& residual) const;
  [[nodiscard]] bool exact_done() const;
  [[nodiscard]] Search search(const Step& step, ConstraintRows::Jacobian jacobian);
  /// Betters trial_ (z_ + step.d, of merit `value`) and its residuals; @returns the merit reached.
  double correct_for_curvature(const Step& step, double value);
  void accept(const Step& step, double taken);

  /// Keyframes only: a quadratic energy, of one minimum, which one Gauss-Newton step reaches.
  [[nodiscard]] bool quadratic() const { return rows_.position_rows().empty(); }
  void start_from_rest_if_there();
  /// Continuation in the weights (see NOTATION.md): goes back to weights that hardly pull.
  void begin_ramp();
  [[nodiscard]] bool ramping() const { return rows_.scale() < 1; }
  void set_scale(double scale);
  /// One Gauss-Newton step at the present scale, then a larger scale when this one has little left.
  void ramp_step();

  void gauss_newton_step();
  void newton_step();
  /// Whether step_ is one of the full second-order model.
  [[nodiscard]] bool full_model() const { return step_kind_ != StepKind::kGaussNewton; }
  /// Conjugate gradients on the full model, preconditioned by the Gauss-Newton factor.
  /// @returns false where they meet a direction without a minimum, or take too many rounds
  [[nodiscard]] bool truncated_newton_step(Curvature curvature);
  void update_curvature();
  /// descent_ <- minus the gradient, multiplier_ <- of the rows as they are.
  void descend();
  void finish_newton_step();
  /// @returns false where the squared system cannot be factored in double precision.
  [[nodiscard]] bool factor_newton();
  void refine_newton_step();
  void apply_newton(const Lanes& d, Lanes& out);
  [[nodiscard]] RowProducts products() const { return {systems_, rows_, state_.jacobian}; }
  /// Takes step_. @returns the part taken, 0 where none lowers the merit.
  [[nodiscard]] double take();
  /// trial_ and its rows <- where step_ leads. @returns as take()
  [[nodiscard]] double find_trial();
  [[nodiscard]] bool newton_pays(double ratio, double gradient) const;

  /// Ends with kImproved if the kinematics throws Error{kCancelled}. The state is then that of the
  /// last accepted iterate, as after on_improved.
  SolveReport iterate(const JobContext& job,
                      const std::function<bool(const SolveReport&)>& on_improved);
  /// A step from where linearise() left off, on the ramp or behind it.
  [[nodiscard]] Outcome step_on(Course& course);
  /// One behind the ramp.
  [[nodiscard]] Outcome advance(Course& course);
  [[nodiscard]] Outcome after_no_decrease(Course& course);
  void weigh_exact_rows(Course& course);
  /// step_ with all of what exact rows are off by.
  void meet_exact();
  void give_back_multipliers();
  /// A cold start in addition to the present answer; the better of the two stays (see NOTATION.md).
  /// `on_improved` hears of the present answer meanwhile and may stop it.
  SolveReport challenge(const JobContext& job,
                        const std::function<bool(const SolveReport&)>& on_improved,
                        SolveReport answer);

  [[nodiscard]] SolveReport report(SolveStatus status, int iterations, double gradient) const;
  /// The report of an unfinished iteration: without energies if those of z_ are unknown.
  [[nodiscard]] SolveReport report_given_up(int iterations, double gradient) const;
  void say_rank(SolveReport& report) const;
  /// Whether no step can lower the exact rows' errors further to first order: all that is left is
  /// contradiction.
  [[nodiscard]] bool only_contradiction_left() const;

  static constexpr double kExactWeightStart = 1e4;  // first penalty of exact constraints
  /// If a target has moved this far (body lengths) since the last challenge, the motion may be in
  /// the valley of a worse minimum.
  static constexpr double kFarTravel = 0.1;
  /// .. a velocity's by the distance that it makes in so many frames.
  static constexpr double kTravelFrames = 10;
  /// A decrease that is smaller than this part of the merit cannot be seen in the merit.
  static constexpr double kRounding = 1e-12;

  SolverOptions options_;
  double length_;
  ModeSystems systems_;
  ConstraintRows rows_;
  ConstraintSpace space_;
  Eigen::MatrixXd load_;   // see set_load()
  PassiveMotion passive_;  // of it
  Lanes z_;                // at the kept frames: motion() without passive_
  RowState state_;         // at z_
  bool residual_valid_ = false, jacobian_valid_ = false;
  Step step_;
  StepKind step_kind_ = StepKind::kGaussNewton;  // whose factor made step_
  Lanes trial_, force_, descent_, left_, product_, direction_, preconditioned_, correction_,
      candidate_;
  mutable Lanes knots_z_;
  RowState trial_state_, candidate_state_;
  Eigen::VectorXd shifted_, multiplier_, along_, promised_, surprise_, no_rows_, multiplier_left_,
      multiplier_before_;  // the last of exact rows that meet_exact() has changed; empty: none
  NewtonSystem newton_;
  std::vector<Eigen::MatrixXd> curvature_;
  /// The answer may be in the valley of a worse minimum: the set of constraints, ends or dynamics
  /// changed, a target has moved far, or a challenge was stopped.
  bool needs_check_ = false;
  bool from_rest_ = false;  // the ramp began at z = 0 with the present constraints
  std::map<ConstraintId, Eigen::Vector3d> origins_;  // of targets moved since the last challenge
  double settled_energy_ = 0;                        // of the last answer
  std::shared_ptr<Optimizer> challenger_;  // where the last challenge was stopped; null after edits
  NewtonGuard guard_;
  bool curvature_valid_ = false;
  bool chord_ = false;  // the next Newton step reuses the factor, or the curvature if truncated
  bool newton_last_ = false;  // the last solve ended with Newton steps: so the next begins
  int slow_truncated_ = 0;    // truncated steps in a row that hardly shrank
  bool exact_slow_ = false;   // exact rows hardly get better at the largest weight
  double lost_ = 0;           // decrement of the last step too small to be judged by the merit
  int stage_steps_ = 0;       // taken at the present scale
  bool stage_newton_ = false;
  mutable Eigen::MatrixXd motion_;
  mutable bool motion_valid_ = false;
};

}  // namespace limber::spacetime
