#pragma once

#include <string>

#include "engine/rods/design/linkage_design.h"

namespace limber::rods::detail {

/// Reason why a search ends where no trial, however near, gives both equilibria, and remedy.
[[nodiscard]] std::string stuck_text(const DesignTrial& trial);

/// The same where a constraint stays violated.
inline constexpr const char* kNothingNearer =
    "no change of sizes reduces the violation further: allow a larger flat height, a smaller least "
    "angle or less cover, or widen the bounds of sizes";

}  // namespace limber::rods::detail
