#include "server/wire/readable.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "server/wire/abbreviate.h"

namespace limber::server {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Bytes of the character that the text begins with; 0: it begins with none (RFC 3629: neither
/// overlong forms nor surrogates).
std::size_t character_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  if (first == 0) return 0;
  if (first < 0x80) return 1;
  const std::size_t size = first < 0xC2   ? 0
                           : first < 0xE0 ? 2
                           : first < 0xF0 ? 3
                           : first < 0xF5 ? 4
                                          : 0;
  if (size == 0 || text.size() < size) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const std::uint8_t second = byte(1);
  if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F)) return 0;
  if ((first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F)) return 0;
  return size;
}

}  // namespace

std::string readable(std::string_view text) {
  const bool is_plain = std::all_of(text.begin(), text.end(), [](char character) {
    return character != 0 && static_cast<std::uint8_t>(character) < 0x80;
  });
  if (is_plain) return std::string(text);
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const std::size_t size = character_size(text);
    result += size > 0 ? text.substr(0, size) : kReplacement;
    text.remove_prefix(std::max<std::size_t>(size, 1));
  }
  return result;
}

std::string field_text(std::string_view field) { return readable(abbreviate(field, 1000)); }

std::string message_text(std::string_view message) { return readable(abbreviate(message, 4000)); }

}  // namespace limber::server
