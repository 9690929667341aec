#include "server/log/log.h"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <string>

#include "server/log/json_line.h"

namespace limber::server::log {
namespace {

std::atomic<Level> threshold{Level::kInfo};
std::atomic<Format> format_of_lines{Format::kText};

std::string timestamp() {
  const auto now = std::chrono::system_clock::now();
  const auto seconds = std::chrono::system_clock::to_time_t(now);
  const auto since = now.time_since_epoch();
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(since).count() % 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900,
                     utc.tm_mon + 1, utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, ms);
}

std::string text_line(Level level, std::string_view text) {
  std::string line = fmt::format("{} {:<5} ", timestamp(), level_name(level));
  for (const char c : text) {  // text may quote what a client sent
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      fmt::format_to(std::back_inserter(line), "\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      line.push_back(c);
    }
  }
  return line;
}

}  // namespace

void set_level(Level level) noexcept { threshold.store(level, std::memory_order_relaxed); }

bool enabled(Level level) noexcept {
  const Level now = threshold.load(std::memory_order_relaxed);
  return now != Level::kOff && static_cast<int>(level) <= static_cast<int>(now);
}

void set_format(Format format) noexcept {
  format_of_lines.store(format, std::memory_order_relaxed);
}

void write(Level level, std::string_view text, Fields fields) noexcept try {
  std::string line = format_of_lines.load(std::memory_order_relaxed) == Format::kJson
                         ? json_line(timestamp(), level, text, fields)
                         : text_line(level, text);
  line.push_back('\n');
  // One write per line: lines of several threads do not mix, and nothing is buffered when the
  // process dies.
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
} catch (...) {  // logging must never take the server down
}

}  // namespace limber::server::log
