#pragma once

#include <Eigen/Core>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/keyframe_system.h"
#include "engine/spacetime/mode_systems.h"
#include "engine/spacetime/newton_system.h"

namespace limber::spacetime {

/// A step in z at the kept frames and the multipliers that go with it.
struct Step {
  Lanes d;
  Eigen::VectorXd m;      // m = W (residual' - J d)
  double decrement2 = 0;  // d^T (K + J^T W J) d: twice the decrease the quadratic model promises
};

/// Gauss-Newton steps through the constraints' rows (see NOTATION.md). With P = K + proximal I:
///   | P  -J^T  | | d |   | r |
///   | J   W^-1 | | m | = | c |
/// Rows of keyframes are eliminated into P (KeyframeSystem); of those of positions and velocities
///   C = W^-1 + J P_key^-1 J^T
/// remains. It has one dense factor, of the size of their number, for any right-hand side until J,
/// W or the knots change. For many rows in many frames (a hold, a path), m is eliminated instead: P
/// + J^T W J in blocks along time, whose cost is linear in frames.
class ConstraintSpace {
 public:
  enum class Form { kRows, kFrames };
  /// Builds and factors the system at these Jacobians, in the cheaper form.
  void factor(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian);
  /// In this form, if that can be factored: of kFrames rounding may leave an indefinite one.
  void factor(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian,
              Form form);
  [[nodiscard]] Form form() const { return form_; }
  [[nodiscard]] bool ready() const { return ready_; }
  /// Jacobians or weights changed.
  void invalidate() { ready_ = false; }
  /// Knots, keyframes, dynamics, ends or S changed.
  void forget() {
    invalidate();
    keyframes_.forget();
  }
  /// Of the factor.
  [[nodiscard]] const Lanes& jacobian() const { return jacobian_; }

  /// Solves the system above. r is overwritten.
  void saddle(const ModeSystems& systems, const ConstraintRows& rows, Lanes& r,
              const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m);

  /// The step that makes the gradient force - J^T m vanish to first order. `force` is K z,
  /// `residual` already shifted. The proximal term is taken out by conjugate gradients on the true
  /// operator.
  /// @param tolerance  of the inner iteration, relative to the decrement
  void step(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& force,
            const Eigen::VectorXd& residual, double tolerance, Step& step);

  /// One back substitution: as step(), but with the Jacobians of the factor and without corrections
  /// afterwards.
  void quick_step(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& force,
                  const Eigen::VectorXd& residual, Step& step);

 private:
  void refine(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& force,
              double tolerance, Step& step);
  [[nodiscard]] double model_decrement2(const ModeSystems& systems, const ConstraintRows& rows,
                                        const Lanes& d);

  bool ready_ = false;
  Form form_ = Form::kRows;
  KeyframeSystem keyframes_;
  NewtonSystem frames_;
  Lanes jacobian_;          // lanes x terms, of the factor
  Eigen::MatrixXd system_;  // C, then its Cholesky factor (lower)
  Lanes work_, product_, residual_, x_, direction_;
  Eigen::VectorXd at_positions_, along_, mu_, mu_direction_, zero_;
};

}  // namespace limber::spacetime
