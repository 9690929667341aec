#pragma once

#include "clients/cli/kind.h"

namespace limber::cli::linkages {

/// Sessions of rod linkages.
[[nodiscard]] const Kind& kind();

}  // namespace limber::cli::linkages
