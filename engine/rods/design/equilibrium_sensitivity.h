#pragma once

#include <Eigen/Core>
#include <memory>

#include "engine/rods/design/design_variables.h"
#include "engine/rods/design/shape_function.h"
#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/equilibrium/hessian_factor.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// Changes of an equilibrium, and of the measures that judge it, with the variables of a design
/// (rod linkages, sec. 3). With x the increments from the equilibrium, L the variables, a the row
/// of the mean angle and p pinned unknowns:
///
///   K = [H a; a^T 0],   K (dx/dL, .) = (-dg/dL, 0),   K (w, .) = (df/dx, 0),
///   df = df/dL - w^T dg/dL,
///
/// where pinned unknowns, and lengths of joints' edges that rest on their bound, stay. Products
/// with second derivatives go forward over that: two solves each with the one factor, and the third
/// derivatives of the energy from LinkageDerivatives. Not from several threads at once.
class EquilibriumSensitivity {
 public:
  /// Factors K.
  /// @pre the state is an equilibrium of the model under the conditions; both outlive this and stay
  /// as they are, until it moves on
  /// @throws Error as Conditions::validate, DesignVariables::validate, {kInvalidArgument} with
  /// field springs, loads or gravity where there are any (their third derivatives are not known
  /// here), {kNumerical} where K is singular
  EquilibriumSensitivity(const LinkageModel& model, const LinkageState& state,
                         const Conditions& conditions, DesignVariables variables = {});
  /// With K as the solver that found the equilibrium factored it.
  /// @param factor  LinkageEquilibrium::take_factor after that; null: made
  EquilibriumSensitivity(const LinkageModel& model, const LinkageState& state,
                         const Conditions& conditions, DesignVariables variables,
                         std::unique_ptr<HessianFactor> factor);
  ~EquilibriumSensitivity();
  EquilibriumSensitivity(EquilibriumSensitivity&&) noexcept;
  EquilibriumSensitivity& operator=(EquilibriumSensitivity&&) noexcept;

  /// Moves to another equilibrium under the same conditions.
  /// @param factor  its own, as above
  /// @returns the memory of the former one
  std::unique_ptr<HessianFactor> move_to(const LinkageState& state,
                                         std::unique_ptr<HessianFactor> factor);
  /// Factors K there.
  /// @throws Error{kNumerical} where it is singular
  void move_to(const LinkageState& state);

  [[nodiscard]] const LinkageState& state() const;
  /// Is the equilibrium stable?
  [[nodiscard]] bool is_minimum() const;

  /// dx/dL v [length, rad].
  /// @param direction  v, a number for each variable
  [[nodiscard]] Eigen::VectorXd shape_change(const Eigen::VectorXd& direction) const;

  /// d2x/dL2 [v, v], the curvature of the shape's path when variables go straight along v. The
  /// third derivatives along w = (dx/dL v, v) give K (d2x/dL2 [v, v], .) = (-D^3 E[w, w, .], 0).
  /// @param change  shape_change(direction)
  [[nodiscard]] Eigen::VectorXd shape_curvature(const Eigen::VectorXd& direction,
                                                const Eigen::VectorXd& change) const;

  struct Adjoint {
    Eigen::VectorXd gradient;    // of the function by variables, through the equilibrium
    Eigen::VectorXd multiplier;  // w; empty: zero
  };
  [[nodiscard]] Adjoint adjoint(ShapeFunction& function) const;
  /// For the elastic energy alone, without a solve. Reactions balance dE/dx at the equilibrium, so
  /// that w = 0 and df = dE/dL (the envelope theorem). The imbalance that the equilibrium's
  /// tolerance left goes into it to first order, and not to second as with the multiplier.
  [[nodiscard]] Adjoint elastic_adjoint() const;

  /// The derivative of `gradient` along v.
  /// @param function  with elastic_adjoint() the elastic energy
  /// @param change  shape_change(direction)
  [[nodiscard]] Eigen::VectorXd product(ShapeFunction& function, const Adjoint& adjoint,
                                        const Eigen::VectorXd& direction,
                                        const Eigen::VectorXd& change) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::rods
