#pragma once

#include <string>
#include <vector>

#include "engine/rods/equilibrium/deployment.h"

namespace limber::rods::detail {

[[nodiscard]] Resistance greatest_resistance(LinkageEquilibrium& equilibrium,
                                             const LinkageState& state, const Conditions& held);

/// Events of the branch and their places; empty if there are none.
[[nodiscard]] std::string describe_events(const std::vector<DeploymentStep>& path);

}  // namespace limber::rods::detail
