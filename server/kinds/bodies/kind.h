#pragma once

#include <memory>

#include "server/kinds/kind.h"

namespace limber::server {

/// @param options  where built models are kept
[[nodiscard]] std::unique_ptr<const Kind> make_body_kind(const ServerOptions& options);

}  // namespace limber::server
