#pragma once

#include <memory>

#include "server/kinds/kind.h"

namespace limber::server {

[[nodiscard]] std::unique_ptr<const Kind> make_beam_kind();

}  // namespace limber::server
