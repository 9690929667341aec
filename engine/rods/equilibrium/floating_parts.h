#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// Removes the rigid motion, relative to the shape before, of parts that nothing holds in place.
/// The joint that a solve happens to hold there does not determine where the part is.
///
/// Parts that no pin, spring or load touches move and turn by the best fit of their vertices, so
/// that their middle stays. Parts that loads alone touch move only, since loads have their
/// directions.
///
/// @param from    conditions of the shape before; its pins have been replaced by those of `to`
/// @param to      conditions of the shape; both are valid for the model
/// @param before  a shape of the same model
void keep_in_place(const LinkageModel& model, const Conditions& from, const Conditions& to,
                   const LinkageState& before, LinkageState& state);

/// Rigid motions of parts that springs touch and do not hold, as a spring at one joint. Nothing
/// resists these motions, so that equilibria do not determine them, and extrapolations of them
/// grow.
class FreeMotions {
 public:
  /// @param conditions  valid for the model
  FreeMotions(const LinkageModel& model, const Conditions& conditions, const LinkageState& state);

  /// Removes them from a motion to first order, in the reduced unknowns, so that the rest moves
  /// vertices least.
  void remove_from(Eigen::VectorXd& motion) const;

 private:
  void add(const LinkageModel& model, const LinkageState& state, int component,
           const Eigen::Vector3d& about, const Eigen::Matrix<double, 6, 1>& direction);

  std::vector<Eigen::VectorXd> motions_, places_;  // all unknowns; those that are positions alone
};

}  // namespace limber::rods
