#pragma once

#include <cstdint>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace limber::server {

/// Requests of subscribers: prefixes of topics, by connection, or by stream if a connection has
/// several. Thread-safe.
class Subscriptions {
 public:
  static constexpr std::size_t kLongestTopic = 128;   // longer prefixes match no topic of ours
  static constexpr std::size_t kMaxOfOne = 1024;      // prefixes of one
  static constexpr std::size_t kMaxPrefixes = 65536;  // different ones, of all

  enum class Noted {
    kSubscription,  // to a prefix that topics of ours may have
    kTooMany,  // not noted; reported once per connection, whose messages are ignored from then on
    kNothing
  };
  /// @param connection  Peer::number; of a stream a number of its own
  /// @param message  from the XPUB socket: 1 or 0, then the prefix
  /// @param group  subscribers that make room together (streams of a connection); 0: it is alone. A
  /// number of one of them, and always the same
  Noted note(std::uint64_t connection, std::string_view message, std::uint64_t group = 0);
  /// Those that had to make room, each reported once. If all together have kMaxPrefixes, the
  /// largest member of the largest group loses all its prefixes for a new one of another. Messages
  /// of it are ignored from then on.
  [[nodiscard]] std::vector<std::uint64_t> take_displaced();
  /// The connection has ended.
  void forget(std::uint64_t connection);
  [[nodiscard]] bool has_subscriber(std::string_view topic) const;
  /// Is this connection one?
  [[nodiscard]] bool is_subscribed(std::uint64_t connection, std::string_view topic) const;

 private:
  struct Subscriber {
    std::unordered_set<std::string> prefixes;
    std::uint64_t group = 0;
    bool is_cut_off = false;
  };
  void release(const std::string& prefix);
  // With the lock:
  [[nodiscard]] bool make_room_for(std::uint64_t connection);
  [[nodiscard]] std::uint64_t greediest(std::uint64_t of_equals) const;

  mutable std::shared_mutex mutex_;
  std::unordered_map<std::uint64_t, Subscriber> subscribers_;
  std::unordered_map<std::string, std::size_t> prefixes_;  // how many connections have each
  std::vector<std::uint64_t> displaced_;                   // not yet reported
};

}  // namespace limber::server
