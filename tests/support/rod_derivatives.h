#pragma once

#include "engine/rods/rod/rod_state.h"

// Derivatives along a direction of change of unknowns and parameters, by running the kernels of
// energy, gradient and Hessian on dual numbers: exact, at any state, with source frames held fixed.

namespace limber::rods {

struct RodDirection {
  Eigen::VectorXd unknowns;                   // layout.unknowns() numbers; empty: they stay
  const RodParameters* parameters = nullptr;  // RodParameters::direction; absent: they stay
};

/// d/d epsilon of the gradient: a Hessian-vector product by unknowns, parameters, or both.
[[nodiscard]] Eigen::VectorXd gradient_derivative(const RodState& state,
                                                  const RodParameters& parameters,
                                                  const RodDirection& direction);

/// d/d epsilon of the Hessian: third derivatives, contracted with one direction.
[[nodiscard]] HessianBlocks hessian_derivative(const RodState& state,
                                               const RodParameters& parameters,
                                               const RodDirection& direction);

/// The Hessian away from the source frame, with the terms of the finite transport. Newton's method
/// has no use for it (RodAtSource::hessian is cheaper); derivatives of Hessians are made of it.
[[nodiscard]] HessianBlocks transported_hessian(const RodState& state,
                                                const RodParameters& parameters);

}  // namespace limber::rods
