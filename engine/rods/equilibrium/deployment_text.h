#pragma once

#include <string>
#include <vector>

#include "engine/rods/equilibrium/deployment.h"

namespace limber::rods::detail {

[[nodiscard]] Resistance greatest_resistance(LinkageEquilibrium& equilibrium,
                                             const LinkageState& state, const Conditions& held);

/// What happened to the branch and where; empty where nothing did.
[[nodiscard]] std::string describe_events(const std::vector<DeploymentStep>& path);

}  // namespace limber::rods::detail
