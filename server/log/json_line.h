#pragma once

#include <string>
#include <string_view>

#include "server/log/log.h"

namespace limber::server::log {

/// One event as one JSON object, without line break: time, level, message, then the fields. Bytes
/// that are not UTF-8 become U+FFFD.
/// @param time  RFC 3339
[[nodiscard]] std::string json_line(std::string_view time, Level level, std::string_view message,
                                    Fields fields);

/// "error", "warn", "info", "debug"
[[nodiscard]] const char* level_name(Level level) noexcept;

}  // namespace limber::server::log
