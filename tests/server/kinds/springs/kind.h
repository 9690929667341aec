#pragma once

#include <memory>

#include "server/kinds/kind.h"

namespace limber::server::springs {

[[nodiscard]] std::unique_ptr<const Kind> make_kind();

}  // namespace limber::server::springs
