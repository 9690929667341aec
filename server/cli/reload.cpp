#include "server/cli/reload.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "server/log/log.h"
#include "server/transport/curve.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::array<std::string_view, 10> kLive{
    "log-level",  "log-format",      "drain-seconds", "max-sessions",      "max-tets",
    "max-frames", "max-constraints", "max-jobs",      "max-session-bytes", "max-memory-bytes"};

}  // namespace

bool Reload::is_live(const std::string& name) const {
  if (name == "curve-allow") return !options_.curve_allow.empty();
  return std::find(kLive.begin(), kLive.end(), name) != kLive.end();
}

void Reload::operator()() {
  try {
    ServeOptions next = options_.read_again ? options_.read_again() : options_;
    next.validate();
    std::optional<AllowedKeys> keys;
    if (!options_.curve_allow.empty()) keys = read_allowed_keys(next.curve_allow);
    apply(next);
    if (keys) {
      log::info("SIGHUP: {} keys are allowed by {}", keys->size(), next.curve_allow.string());
      server_.allow(std::move(*keys));
    }
  } catch (const std::exception& fault) {
    const proto::Error error = error_to_proto(fault);
    log::error(log::Fields{{"error", error.message()}, {"field", error.field()}},
               "SIGHUP: everything stays as it was: {}{}{}", error.field(),
               error.field().empty() ? "" : ": ", error.message());
  }
}

void Reload::apply(const ServeOptions& next) {
  std::size_t changed = 0;
  for (const auto& [name, value] : next.values) {
    std::string& now = options_.values[name];
    if (now == value) continue;
    if (!is_live(name)) {
      log::warn(log::Fields{{"field", name}}, "SIGHUP: {} = {} needs a restart: it stays {}", name,
                value, now);
      continue;
    }
    log::info(log::Fields{{"field", name}}, "SIGHUP: {} = {}, it was {}", name, value, now);
    now = value;
    ++changed;
  }
  if (changed == 0) log::info("SIGHUP: no option has changed");
  options_.curve_allow = next.curve_allow;
  server_.set_limits(next.server.limits);
  server_.set_drain(next.server.drain_s);
  log::set_format(next.log_format);
  log::set_level(next.log_level);
}

}  // namespace limber::server
