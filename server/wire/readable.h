#pragma once

#include <string>
#include <string_view>

namespace limber::server {

/// A text that may repeat bytes of a file, as valid UTF-8: each byte that is part of no character,
/// and each zero byte, is replaced by U+FFFD. A message with other bytes cannot be read by any
/// client.
[[nodiscard]] std::string readable(std::string_view text);

/// Fields and messages of errors and issues, which repeat names and paths of requests: as
/// readable(), and cut if too long.
[[nodiscard]] std::string field_text(std::string_view field);
[[nodiscard]] std::string message_text(std::string_view message);

}  // namespace limber::server
