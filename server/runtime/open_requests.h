#pragma once

#include <array>
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

  /// Besides, of one that changes something. @returns what end_lasting() takes
  [[nodiscard]] unsigned begin_lasting();
  void end_lasting(unsigned epoch) { lasting_.at(epoch).fetch_sub(1); }
  /// From now on requests count as new. Once.
  void begin_epoch() { epoch_.store(1); }

  /// The part of `total()` that changes something: all, or those from before begin_epoch().
  [[nodiscard]] std::uint64_t lasting() const { return old_lasting() + lasting_of(1); }
  [[nodiscard]] std::uint64_t old_lasting() const { return lasting_of(0); }

  [[nodiscard]] std::uint64_t total() const;
  [[nodiscard]] std::uint64_t of(const std::string& client) const;

 private:
  [[nodiscard]] std::uint64_t lasting_of(unsigned epoch) const;

  std::atomic<std::int64_t> total_{0};
  std::array<std::atomic<std::int64_t>, 2> lasting_{};  // by epoch
  std::atomic<unsigned> epoch_{0};
  mutable std::mutex mutex_;
  std::unordered_map<std::string, std::uint64_t> by_client_;  // only those that have some
};

}  // namespace limber::server
