#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// Takes out of a shape the rigid motion, against the one before, of parts that nothing holds in
/// place: which joint a solve happens to hold there says nothing of where the part is.
///
/// Parts that no pin, spring or load touches move and turn by the best fit of their vertices, so
/// that their middle stays; those that loads alone touch move, for loads have their directions.
///
/// @param from    what the shape before was held by; its pins have been replaced by those of `to`
/// @param to      what the shape is held by; in both, valid for the model
/// @param before  a shape of the same model
void keep_in_place(const LinkageModel& model, const Conditions& from, const Conditions& to,
                   const LinkageState& before, LinkageState& state);

/// Rigid motions of parts that springs touch and do not hold, as a spring at one joint: nothing
/// resists them, so that equilibria say nothing of them, and what is extrapolated of them grows.
class FreeMotions {
 public:
  /// @param conditions  valid for the model
  FreeMotions(const LinkageModel& model, const Conditions& conditions, const LinkageState& state);

  /// Takes them out of a motion to first order, in the reduced unknowns, so that what is left moves
  /// vertices least.
  void remove_from(Eigen::VectorXd& motion) const;

 private:
  void add(const LinkageModel& model, const LinkageState& state, int component,
           const Eigen::Vector3d& about, const Eigen::Matrix<double, 6, 1>& direction);

  std::vector<Eigen::VectorXd> motions_, places_;  // all unknowns; those that are positions alone
};

}  // namespace limber::rods
