#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>

namespace limber::server {

/// Requests that have come and have no answer yet, in all and by client. Any thread.
class OpenRequests {
 public:
  /// @param client  its routing id
  void begin(const std::string& client);
  /// Before the reply is sent: a client that has it may send the next request at once.
  void answered(const std::string& client);
  /// After the reply is sent: with a total of 0 every reply is.
  void end() { total_.fetch_sub(1); }
  /// Of those that change something, besides.
  void begin_lasting() { lasting_.fetch_add(1); }
  void end_lasting() { lasting_.fetch_sub(1); }

  /// Of `total()`, those that change something.
  [[nodiscard]] std::uint64_t lasting() const;

  [[nodiscard]] std::uint64_t total() const;
  [[nodiscard]] std::uint64_t of(const std::string& client) const;

 private:
  std::atomic<std::int64_t> total_{0}, lasting_{0};
  mutable std::mutex mutex_;
  std::unordered_map<std::string, std::uint64_t> by_client_;  // only those that have some
};

}  // namespace limber::server
