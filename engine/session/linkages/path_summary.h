#pragma once

#include <string>

#include "engine/rods/equilibrium/deployment.h"
#include "engine/scene/linkage.h"

namespace limber::session {

// The message of a result that reached no equilibrium, in addition to the solver's; each part
// begins with "; " and may be empty.

/// Which joints resist most, in N and N m.
/// @param length_unit  of the scene [m]
[[nodiscard]] std::string describe_resistance(const rods::Resistance& resistance,
                                              double length_unit);

/// The changes from `before` to `requested`: loads, angles, targets, places of pins, gravity.
[[nodiscard]] std::string describe_request(const scene::LinkageConditions& before,
                                           const scene::LinkageConditions& requested,
                                           double length_unit);

}  // namespace limber::session
