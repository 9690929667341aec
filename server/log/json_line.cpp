#include "server/log/json_line.h"

#include <fmt/format.h>

#include <cstddef>

namespace limber::server::log {
namespace {

constexpr std::string_view kReplacement = "\xef\xbf\xbd";

/// How many bytes of valid UTF-8 begin here, of one character; 0: none (RFC 3629).
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  // Neither longer than need be, nor half of a pair of UTF-16, nor beyond U+10FFFF.
  const unsigned char least = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
  const unsigned char most = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
  if (byte(1) < least || byte(1) > most) return 0;
  for (std::size_t i = 2; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
  }
  return length;
}

void append_string(std::string& out, std::string_view text) {
  out += '"';
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const auto c = static_cast<unsigned char>(text.front());
    if (length == 0) {
      out += kReplacement;
    } else if (c == '"' || c == '\\') {
      out += '\\';
      out += text.front();
    } else if (c == '\n') {
      out += "\\n";
    } else if (c < 0x20 || c == 0x7f) {
      fmt::format_to(std::back_inserter(out), "\\u{:04x}", c);
    } else {
      out += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  out += '"';
}

}  // namespace

const char* level_name(Level level) noexcept {
  switch (level) {
    case Level::kError:
      return "error";
    case Level::kWarn:
      return "warn";
    case Level::kInfo:
      return "info";
    case Level::kDebug:
      return "debug";
    case Level::kOff:
      return "off";
  }
  return "?";
}

std::string json_line(std::string_view time, Level level, std::string_view message, Fields fields) {
  std::string out = R"({"time":)";
  append_string(out, time);
  out += R"(,"level":)";
  append_string(out, level_name(level));
  out += R"(,"message":)";
  append_string(out, message);
  for (const Field& field : fields) {
    if (field.value.empty()) continue;
    out += ',';
    append_string(out, field.name);
    out += ':';
    append_string(out, field.value);
  }
  return out + '}';
}

}  // namespace limber::server::log
