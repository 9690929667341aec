#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace limber::server::service_manager {

// Notifications to systemd for a unit with Type=notify (sd_notify(3)). Nothing where there is no
// $NOTIFY_SOCKET.

void ready(const std::string& status);
void reloading();  // ready() ends it
void stopping(const std::string& status);
void feed_watchdog();
/// Within which the watchdog wants to be fed; nothing: there is none.
[[nodiscard]] std::optional<std::chrono::microseconds> watchdog_time();

}  // namespace limber::server::service_manager
