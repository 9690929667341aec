#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/equilibrium/hessian_factor.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/rod/rod_state.h"

namespace limber::rods {

struct EquilibriumOptions {
  int max_iterations = 200;  // Newton steps, > 0
  /// Unbalanced forces over the forces present, and unbalanced moments over the moments present;
  /// rounding of stiff rods is allowed for on top. In (0, 1).
  double tolerance = 1e-8;
  /// Largest angle of a joint or an edge in one step [rad], in (0, 1.5].
  double largest_turn = 0.5;
  /// How often a saddle is left along negative curvature before it is reported, >= 0.
  int max_escapes = 8;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

enum class EquilibriumStatus {
  /// Balanced, and by the inertia of the Hessian there a minimum; under moments of fixed direction
  /// slow motions beside it come back, by the eigenvalues of the full tangent.
  kConverged,
  kIterationLimit,  // out of steps
  kStalled,         // no step, however small, lowered the potential
  kSaddle,          // balanced, but unstable, and no descent direction was found
  kUnbalanced,      // loads push a component that nothing holds
  kCancelled,       // by the caller, also within a step; the state is the last iterate
};

struct EquilibriumReport {
  EquilibriumStatus status = EquilibriumStatus::kIterationLimit;
  int iterations = 0;   // Newton steps; the factorisation that certifies the end is none
  int corrections = 0;  // further solves with a factor at hand
  int factorizations = 0;
  int escapes = 0;  // saddles left
  /// For a converged state; false: judged under moments of fixed direction, by slow motions alone.
  bool is_minimum = true;
  RodEnergies energies;  // elastic
  double spring_energy = 0;
  double load_potential = 0;       // of forces, torques and weight; moments have none
  double max_gradient_scaled = 0;  // see EquilibriumOptions::tolerance
  double final_shift = 0;          // of the last factorisation [force/length^2]; 0: none needed
  /// Directions in which the last unshifted Hessian was unstable; the mean angle's constraint may
  /// hold one of them where there are several. Under moments of fixed direction those of the full
  /// tangent, 0 also where that is not known.
  int negative_eigenvalues = 0;
  /// Largest angle that a joint or an edge has turned by, or a joint been opened by, over the sum
  /// of the steps [rad].
  double turned = 0;
  /// Moment [force length] on every opening angle that holds the mean at its value.
  double mean_angle_moment = 0;
  std::string message;  // reason of the stop

  [[nodiscard]] bool converged() const { return status == EquilibriumStatus::kConverged; }
  [[nodiscard]] double potential() const {
    return energies.total() + spring_energy + load_potential;
  }
};

/// Called with intermediate shapes of the search: after each Newton step with its number, from 1.
/// Before that, with 0 after corrections by the factor of the last equilibrium, which take a
/// fraction of a step. The latter are lower than where the search begins, but it need not continue
/// from them.
using IterateCallback = std::function<void(int iteration, const LinkageState& state)>;

namespace detail {
struct NewtonWorkspace;
}

/// Finds equilibria of one linkage, again and again: memory, the symbolic factorisation and the
/// last shift stay. Not from several threads at once.
///
/// Newton's method on the reduced variables (rod linkages, sec. 1.4). If the factorisation shows
/// that the Hessian is indefinite under the constraints, a multiple of the lumped masses is added.
/// Saddles are left along negative curvature. Results do not depend on the number of threads.
class LinkageEquilibrium {
 public:
  /// @pre the model outlives this; changes of its rest lengths are seen
  explicit LinkageEquilibrium(const LinkageModel& model);
  ~LinkageEquilibrium();
  LinkageEquilibrium(LinkageEquilibrium&&) noexcept;
  LinkageEquilibrium& operator=(LinkageEquilibrium&&) noexcept;

  [[nodiscard]] const LinkageModel& model() const;

  /// The equilibrium near a state, which becomes it; also where this stops early.
  /// @throws Error as Conditions::validate and EquilibriumOptions::validate
  EquilibriumReport solve(LinkageState& state, const Conditions& conditions,
                          const EquilibriumOptions& options = {}, const JobContext& context = {},
                          const IterateCallback& on_iterate = {});

  /// Energies, balance and stability of a state as it is: converged where it balances to the
  /// tolerance and is stable, else stalled. @throws Error as solve
  [[nodiscard]] EquilibriumReport judge(const LinkageState& state, const Conditions& conditions,
                                        const EquilibriumOptions& options = {});

  /// Reactions of pins, set angles and the mean angle on the joints in a state. Given as loads,
  /// they would leave it in balance in place of these. Joints that feel nothing beyond rounding are
  /// left out.
  /// @throws Error as Conditions::validate
  [[nodiscard]] std::vector<JointLoad> reactions(const LinkageState& state,
                                                 const Conditions& conditions);

  /// The direction that is resisted least, per lumped mass, at unit largest turn: a unit of it
  /// turns some joint or edge by 1 rad. In the reduced unknowns.
  /// @throws Error as Conditions::validate
  [[nodiscard]] Eigen::VectorXd softest_direction(const LinkageState& state,
                                                  const Conditions& conditions);

  /// First-order motions of an equilibrium, in the reduced unknowns; both empty where they are not
  /// known.
  struct Motion {
    Eigen::VectorXd left;   // remaining motion within the tolerance, one Newton step
    Eigen::VectorXd ahead;  // on to other conditions
  };
  /// With the factor that certified it, two solves.
  /// @param state  the state to which the last solve has converged
  /// @param here   its conditions
  /// @param ahead  nearby ones, with the same pins
  /// @throws Error as Conditions::validate
  [[nodiscard]] Motion motion(const LinkageState& state, const Conditions& here,
                              const Conditions& ahead);

  /// The factor that certified the result of the last solve: of the Hessian there, with no shift,
  /// and the gradient. Later solves use other memory.
  /// @param spare  that memory, of the same model's structure; null: made. Stays with the caller
  /// where null is returned
  /// @returns null where the last solve did not converge, where only rounding's shift made the
  /// Hessian definite (mechanisms), and where the factor was taken or used since
  [[nodiscard]] std::unique_ptr<HessianFactor> take_factor(
      std::unique_ptr<HessianFactor>&& spare = {});

  /// Tells the next solve that the state it starts from is a guess.
  /// @param from  an equilibrium, from which it is
  /// @param step  this far, to first order; see EdgeTensions::expect
  void expect_step(const LinkageState& from, const Eigen::VectorXd& step);

  /// Sum of the increments of the last solve, in the reduced unknowns: nearly the path from its
  /// first state to its last, as a predictor takes it.
  [[nodiscard]] const Eigen::VectorXd& last_increment() const;

 private:
  std::unique_ptr<detail::NewtonWorkspace> workspace_;
};

}  // namespace limber::rods
