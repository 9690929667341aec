#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace limber::scene::formats {

/// Decodes base64 (RFC 4648) with blanks anywhere. Padding may occur in the middle: VTK
/// concatenates separately encoded pieces (a header, then data). Stops after `max_bytes`. @returns
/// empty if a character is not base64.
[[nodiscard]] std::optional<std::string> decode_base64(std::string_view text,
                                                       std::size_t max_bytes);
[[nodiscard]] std::string encode_base64(std::string_view bytes);

}  // namespace limber::scene::formats
