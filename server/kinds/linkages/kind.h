#pragma once

#include <memory>

#include "server/kinds/kind.h"

namespace limber::server {

[[nodiscard]] std::unique_ptr<const Kind> make_linkage_kind();

}  // namespace limber::server
