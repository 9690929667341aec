#pragma once

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods::detail {

/// Conditions along the path from the present ones to the target.
class ConditionPath {
 public:
  /// @param released  reactions of `from` on joints that `to` does not exert
  /// @pre both are valid for the model
  ConditionPath(const LinkageState& start, Conditions from, Conditions to,
                std::vector<JointLoad> released);

  /// @param progress  0 .. 1
  [[nodiscard]] Conditions at(double progress) const;
  /// Are conditions elsewhere the same as at the end?
  [[nodiscard]] bool stays() const;

 private:
  Conditions from_, to_;
  std::vector<JointLoad> released_;
  std::vector<double> angles_;              // at the start, of to_.angles
  std::vector<Eigen::Vector3d> positions_;  // at the start, of to_.pins
  double mean_angle_;
};

/// Remaining reactions at the joints when `to` replaces `from`: those of pins and angles that `to`
/// does not hold.
/// @param reactions  under `from`, see LinkageEquilibrium::reactions
[[nodiscard]] std::vector<JointLoad> released_reactions(const LinkageModel& model,
                                                        const std::vector<JointLoad>& reactions,
                                                        const Conditions& from,
                                                        const Conditions& to);

/// Without those that would push components which `to` leaves floating.
[[nodiscard]] std::vector<JointLoad> without_pushes(const LinkageModel& model,
                                                    std::vector<JointLoad> released,
                                                    const Conditions& to);

/// Without the loads on components that `from` keeps in place and `to` leaves floating, and without
/// the weight if there are such components: nothing would balance them while they fade.
[[nodiscard]] Conditions without_loads_on_released(const LinkageModel& model, Conditions from,
                                                   const Conditions& to);

}  // namespace limber::rods::detail
