#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "bench/live_server.h"

namespace limber::bench {

/// Clients each of which opens one body after the other and closes it once it has a final result.
/// None is in the server's cache of models: each is built.
class BackgroundBuilds {
 public:
  /// @param sample  whose density makes it another body each time
  BackgroundBuilds(const ServerProcess& server, const std::string& sample, int clients);
  /// Lets those that are being built come to their end.
  ~BackgroundBuilds();
  BackgroundBuilds(const BackgroundBuilds&) = delete;
  BackgroundBuilds& operator=(const BackgroundBuilds&) = delete;
  /// Number of built bodies so far.
  [[nodiscard]] int built() const { return built_; }
  /// Whether a client gave up: then the load during the measurement is smaller.
  [[nodiscard]] bool has_failed() const { return has_failed_; }

 private:
  std::atomic<bool> is_over_{false}, has_failed_{false};
  std::atomic<int> built_{0};
  std::vector<std::thread> threads_;
};

}  // namespace limber::bench
