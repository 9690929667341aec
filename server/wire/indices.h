#pragma once

#include <cstdint>
#include <string>

#include "server/wire/errors.h"

namespace limber::server {

/// A count, frame or node. @throws Refusal OUT_OF_RANGE naming `field`
[[nodiscard]] int decode_index(std::uint32_t value, const std::string& field);

}  // namespace limber::server
