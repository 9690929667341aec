#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "bench/live_server.h"

namespace limber::bench {

/// When frames of a session came, by their revision: read on a thread of its own, since frames may
/// come before the acknowledgement.
class Arrivals {
 public:
  using Clock = std::chrono::steady_clock;

  Arrivals(LiveClient& client, const ServerProcess& server, const std::string& session);
  ~Arrivals();
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;

  struct Times {
    Clock::time_point first, converged;
  };
  /// Arrival of the next revision, or a newer one. Waits for its final frames.
  /// @throws std::runtime_error where the stream is silent
  Times of(std::uint64_t revision);
  /// The first frames of this revision or a newer one, waited for so long. @returns whether there
  /// were any
  bool first_of(std::uint64_t revision, std::chrono::milliseconds patience,
                Clock::time_point& first);

 private:
  void read();

  LiveStream stream_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::map<std::uint64_t, Clock::time_point> first_;
  std::uint64_t converged_revision_ = 0;
  Clock::time_point converged_;
  std::string fault_;
  std::atomic<bool> is_ending_{false};
  std::thread thread_;  // last: it uses the rest
};

}  // namespace limber::bench
