#pragma once

#include <string>
#include <vector>

#include "engine/rods/equilibrium/deployment.h"

namespace limber::rods::detail {

/// Which of the joints that conditions hold resists most; begins with "; ", empty where none does.
[[nodiscard]] std::string told_strain(LinkageEquilibrium& equilibrium, const LinkageState& state,
                                      const Conditions& held);

/// What happened to the branch and where; empty where nothing did.
[[nodiscard]] std::string told_events(const std::vector<DeploymentStep>& path);

}  // namespace limber::rods::detail
