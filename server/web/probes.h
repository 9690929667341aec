#pragma once

#include <functional>
#include <string>
#include <vector>

namespace limber::server::web {

/// The gateway's answers to monitoring, without a token. Asked on the gateway's thread: must be
/// quick.
struct Probes {
  /// Reasons to send no clients now, a sentence each; empty: it is ready.
  std::function<std::vector<std::string>()> not_ready = [] { return std::vector<std::string>(); };
  /// In the text format of Prometheus.
  std::function<std::string()> metrics = [] { return std::string(); };
};

}  // namespace limber::server::web
