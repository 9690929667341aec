#pragma once

#include <string>

#include "engine/rods/equilibrium/deployment.h"
#include "engine/scene/linkage.h"

namespace limber::session {

// What a result that reached no equilibrium says beside the solver's message; each begins with "; "
// and is empty where there is nothing to say.

/// Which joints resist most, in N and N m.
/// @param length_unit  of the scene [m]
[[nodiscard]] std::string describe_resistance(const rods::Resistance& resistance,
                                              double length_unit);

/// What `requested` asks for that `before` did not: loads, angles, targets, places of pins,
/// gravity.
[[nodiscard]] std::string describe_request(const scene::LinkageConditions& before,
                                           const scene::LinkageConditions& requested,
                                           double length_unit);

}  // namespace limber::session
