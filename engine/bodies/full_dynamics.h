#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>

#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/bodies/dof_map.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/stvk.h"
#include "engine/bodies/time_stepping.h"

namespace limber::bodies {

struct DynamicsOptions {
  TimeStepping scheme = TimeStepping::kImplicitMidpoint;
  double time_step = 1.0 / 240;  // [s], > 0
  /// Force -mass_damping M v [1/s], >= 0: slows every motion alike, rigid ones too.
  double mass_damping = 0;
  /// Kelvin-Voigt: stress of the strain's rate times this [s], >= 0. Rigid motions are free of it.
  double relaxation_time = 0;
  /// The remaining gain of Newton's method in a step, relative to its energies, squared; >= 1e-12.
  double tolerance = 1e-8;
  int max_newton_steps = 60;  // >= 1

  /// @throws Error{kInvalidArgument} naming the member, its value and the inequality
  void validate() const;
};

/// 3n each, ordered 3 * node + axis; zero at fixed nodes.
struct DynamicState {
  Eigen::VectorXd displacement;  // u [m]
  Eigen::VectorXd velocity;      // v [m/s]
};

struct StepReport {
  enum class Status {
    kConverged,
    kNotConverged,  // max_newton_steps, or no decrease: the state is as it was before the step
  };
  Status status = Status::kConverged;
  int newton_steps = 0;
  double left = 0;  // what DynamicsOptions::tolerance bounds
};

/// Motion of an elastic body without reduction:  M a + alpha M v + f_int(u, v) = f  (StVK,
/// consistent mass), by implicit steps. One step finds w = u at its end (Euler) or middle
/// (midpoint), D after its begin. It is the minimum of
///   |w - u - D v|_M^2 / (2 D^2) + alpha |w - u|_M^2 / (2 D) + W(w; strains of u) - f . w,
/// by Newton's method with a line search. If the second derivative is indefinite, the pressure part
/// of the stress is left out of it (StvkEnergy::Curvature::kPositive).
///
/// References: Hairer, Lubich, Wanner, Geometric Numerical Integration, II.1 and IV.2 (midpoint
/// rule); Kane et al. 2000, Variational integrators (the minimum).
class FullDynamics {
 public:
  /// At rest. `body` is kept by reference and must outlive this.
  /// @throws as DynamicsOptions::validate
  FullDynamics(const ElasticBody& body, const DynamicsOptions& options);

  [[nodiscard]] const DynamicState& state() const { return state_; }
  /// @throws Error{kInvalidArgument} of another size, not finite, or not zero at a fixed node
  void set_state(DynamicState state);

  /// One step under the force `f`, 3n [N], taken as constant over it.
  [[nodiscard]] StepReport step(const Eigen::Ref<const Eigen::VectorXd>& force);
  /// The same of another length [s].
  [[nodiscard]] StepReport step(const Eigen::Ref<const Eigen::VectorXd>& force, double time_step);

  [[nodiscard]] double kinetic_energy() const;  // [J]
  [[nodiscard]] double elastic_energy() const;  // [J]
  [[nodiscard]] const StvkEnergy& elasticity() const { return elasticity_; }
  /// M, 3n x 3n [kg].
  [[nodiscard]] const Eigen::SparseMatrix<double>& mass() const { return mass_; }

 private:
  struct Potential;  // of one step
  [[nodiscard]] double value(const Potential& potential, const Eigen::VectorXd& w) const;
  [[nodiscard]] Eigen::VectorXd gradient(const Potential& potential,
                                         const Eigen::VectorXd& w) const;
  /// Factors the second derivative at w; the exact one where that is definite.
  void factor(const Potential& potential, const Eigen::VectorXd& w);
  [[nodiscard]] StepReport minimise(const Potential& potential, Eigen::VectorXd& w);

  const ElasticBody& body_;
  DynamicsOptions options_;
  GradientOperator gradient_;
  StvkEnergy elasticity_;
  DofMap dofs_;
  Eigen::SparseMatrix<double> mass_, free_mass_;
  SparseCholesky cholesky_;
  DynamicState state_;
};

}  // namespace limber::bodies
