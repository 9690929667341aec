#pragma once

#include "clients/cli/kind.h"

namespace limber::cli::bodies {

/// Sessions of elastic bodies.
[[nodiscard]] const Kind& kind();

}  // namespace limber::cli::bodies
