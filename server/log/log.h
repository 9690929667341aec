#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace limber::server::log {

enum class Level { kError, kWarn, kInfo, kDebug, kOff };

/// Events less urgent than this are not written. Default kInfo. Thread-safe.
void set_level(Level level) noexcept;
[[nodiscard]] bool enabled(Level level) noexcept;

/// One event, one line on standard error: time (UTC), level, text. Line breaks inside `text` are
/// escaped.
void write(Level level, std::string_view text) noexcept;

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

}  // namespace limber::server::log
