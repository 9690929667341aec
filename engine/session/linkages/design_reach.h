#pragma once

#include <Eigen/Core>

#include "engine/session/linkages/design_values.h"

namespace limber::session {

/// Larger distances, whose squares dominate all other terms, are mistakes of units or origins.
/// @param joints  positions of the deployed linkage's
/// @throws Error{kOutOfRange} with fields targets[i].position, surface
void demand_near(const DesignGoal& goal, const Eigen::Matrix3Xd& joints);

}  // namespace limber::session
