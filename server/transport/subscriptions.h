#pragma once

#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <unordered_set>

namespace limber::server {

/// What subscribers asked for: prefixes of topics. Thread-safe.
class Subscriptions {
 public:
  /// A message from the XPUB socket: 1 or 0, then the prefix. @returns the prefix where it is a
  /// subscription
  std::optional<std::string> note(std::string_view message);
  [[nodiscard]] bool wanted(std::string_view topic) const;

 private:
  static constexpr std::size_t kLongestTopic = 128;    // longer prefixes match no topic of ours
  static constexpr std::size_t kMostPrefixes = 65536;  // beyond: everything counts as wanted

  mutable std::shared_mutex mutex_;
  std::unordered_set<std::string> prefixes_;
  bool overflow_ = false;
};

}  // namespace limber::server
