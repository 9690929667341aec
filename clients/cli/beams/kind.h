#pragma once

#include "clients/cli/kind.h"

namespace limber::cli::beams {

/// Sessions of structures of beams.
[[nodiscard]] const Kind& kind();

}  // namespace limber::cli::beams
