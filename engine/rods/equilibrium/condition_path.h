#pragma once

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods::detail {

/// Conditions on the way from what is to what is wanted.
class ConditionPath {
 public:
  /// @pre both are valid for the model
  ConditionPath(const LinkageState& start, Conditions from, Conditions to);

  /// @param progress  0 .. 1
  [[nodiscard]] Conditions at(double progress) const;

 private:
  Conditions from_, to_;
  std::vector<double> angles_;              // at the start, of to_.angles
  std::vector<Eigen::Vector3d> positions_;  // at the start, of to_.pins
  double mean_angle_;
};

}  // namespace limber::rods::detail
