#pragma once

#include <string>

#include "clients/cli/kind.h"

namespace limber::cli {

/// The kind of a session; of one that limber.v1 does not know, what all kinds have.
[[nodiscard]] const Kind& kind_of(const v1::SessionStatus& status);
[[nodiscard]] const Kind& kind_of(const v1::ResultInfo& result);

/// One result as lines "name  value".
[[nodiscard]] std::string describe(const v1::ResultInfo& result);

}  // namespace limber::cli
