#pragma once

#include <fmt/format.h>

#include "engine/base/error.h"

namespace limber::session {

/// @throws Error{kInvalidArgument} naming `field` where it is negative
inline void demand_not_negative(int value, const char* field) {
  if (value < 0)
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("{} = {}, must be >= 0", field, value));
}

}  // namespace limber::session
