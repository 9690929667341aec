#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace limber::server::log {

enum class Level { kError, kWarn, kInfo, kDebug, kOff };

/// Events less urgent than this are not written. Default kInfo. Thread-safe.
void set_level(Level level) noexcept;
[[nodiscard]] bool enabled(Level level) noexcept;

/// How events are written: one line each.
enum class Format {
  kText,  // time (UTC), level, text
  kJson,  // a JSON object of these and of the fields, see json_line()
};
/// Default kText. Thread-safe.
void set_format(Format format) noexcept;

/// A field of an event, for machines: `session`, `client` (its number), `job`, `error` (a code or
/// reason), `field`. The text says it for people. Empty ones are left out.
struct Field {
  std::string_view name;
  std::string value;
};
using Fields = std::initializer_list<Field>;

/// One event on standard error. Line breaks inside `text` are escaped.
void write(Level level, std::string_view text, Fields fields = {}) noexcept;

template <class... Args>
void error(fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kError))
    write(Level::kError, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warn(fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kWarn)) write(Level::kWarn, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kInfo)) write(Level::kInfo, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void debug(fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kDebug))
    write(Level::kDebug, fmt::format(format, std::forward<Args>(args)...));
}

// With fields: log::info(log::Fields{{"session", id}}, "session {} ...", id)
template <class... Args>
void error(Fields fields, fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kError))
    write(Level::kError, fmt::format(format, std::forward<Args>(args)...), fields);
}
template <class... Args>
void warn(Fields fields, fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kWarn))
    write(Level::kWarn, fmt::format(format, std::forward<Args>(args)...), fields);
}
template <class... Args>
void info(Fields fields, fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kInfo))
    write(Level::kInfo, fmt::format(format, std::forward<Args>(args)...), fields);
}
template <class... Args>
void debug(Fields fields, fmt::format_string<Args...> format, Args&&... args) {
  if (enabled(Level::kDebug))
    write(Level::kDebug, fmt::format(format, std::forward<Args>(args)...), fields);
}

}  // namespace limber::server::log
