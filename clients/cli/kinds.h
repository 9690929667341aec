#pragma once

#include <string>

#include "clients/cli/kind.h"

namespace limber::cli {

/// The kind of a session; for a kind that limber.v1 does not know, the common base.
[[nodiscard]] const Kind& kind_of(const v1::SessionStatus& status);

/// One result as lines "name  value".
[[nodiscard]] std::string describe(const Kind& kind, const v1::ResultInfo& result);

}  // namespace limber::cli
