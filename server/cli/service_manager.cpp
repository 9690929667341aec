#include "server/cli/service_manager.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <cstdint>
#include <ctime>

namespace limber::server::service_manager {
namespace {

constexpr int kKeepEnvironment = 0;

void tell(const std::string& state) { ::sd_notify(kKeepEnvironment, state.c_str()); }

}  // namespace

void ready(const std::string& status) { tell(fmt::format("READY=1\nSTATUS={}", status)); }

void reloading() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const std::int64_t us = std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
  tell(fmt::format("RELOADING=1\nMONOTONIC_USEC={}\nSTATUS=Reading the configuration again", us));
}

void stopping(const std::string& status) { tell(fmt::format("STOPPING=1\nSTATUS={}", status)); }

void feed_watchdog() { tell("WATCHDOG=1"); }

std::optional<std::chrono::microseconds> watchdog_time() {
  std::uint64_t us = 0;
  if (::sd_watchdog_enabled(kKeepEnvironment, &us) <= 0) return std::nullopt;
  return std::chrono::microseconds(us);
}

}  // namespace limber::server::service_manager
