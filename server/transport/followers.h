#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/transport/address.h"
#include "server/transport/followed_stream.h"
#include "server/transport/subscriptions.h"

namespace limber::server {

/// What a subscriber has of a topic that it asks for.
enum class Has {
  kNothing,
  kNewest,  // the newest message that was published; of prefixes of topics never said
};

/// What a client asks for that follows a stream (FollowRequest).
struct Following {
  struct Topic {
    std::string prefix;
    std::uint64_t after = 0;  // sequence of the newest message that was read of it; 0: none
  };
  std::string stream;
  std::vector<Topic> topics;
  std::uint64_t read_bytes = 0, window_bytes = 0;
  // Who asks, for those who look: its number, and what people call it.
  std::uint64_t client = 0;
  std::string name;
};

struct FollowAnswer {
  bool continued = false;
  std::string cut_off;  // why it had ended; empty: it had not
  std::uint64_t left_out = 0, window_bytes = 0;
  bool is_taken = true;  // false: there are too many prefixes of topics, the stream has ended
};

/// How one follower does.
struct FollowerUse {
  std::uint64_t client = 0;
  std::string name;
  std::uint32_t topics = 0;
  std::uint64_t waiting_bytes = 0, unread_bytes = 0, sent = 0, left_out = 0;
  double stalled_s = 0;
};

/// Those who follow streams, and what is known of those that did. One thread changes it, any may
/// ask uses().
class Followers {
 public:
  using Clock = FollowedStream::Clock;
  /// Streams without a connection that are remembered, the newest.
  static constexpr std::size_t kMostRemembered = 1024;

  struct Follower {
    std::uint64_t number = 0;  // as a subscriber (Subscriptions)
    std::string key;           // of the stream: who may continue it, and its name
    Address address;
    std::uint64_t client = 0;
    std::string name;
    std::set<std::string> prefixes;
    FollowedStream stream;
  };

  Followers(std::uint64_t queue_bytes, Subscriptions& subscriptions)
      : queue_bytes_(queue_bytes), subscriptions_(subscriptions) {}

  struct Begun {
    FollowAnswer answer;
    Follower* follower = nullptr;  // null: it has ended
    /// Prefixes that are new to it, with what was read of them.
    std::vector<Following::Topic> fresh;
  };
  /// @param number  for a stream that is not there
  Begun follow(const Address& address, Following wanted, std::uint64_t number,
               Clock::time_point now);
  [[nodiscard]] Follower* of_client(const std::string& client);
  [[nodiscard]] Follower* of_number(std::uint64_t number);
  /// Of the client with this routing id, where it follows. It is remembered, and told the reason
  /// when it comes again.
  void end(const std::string& client, const std::string& reason);

  /// Into the queues of those who want it. @returns messages that were given up for it
  std::uint64_t publish(const std::string& topic, const SharedMessages& messages,
                        TopicSlots::Keep keep, Clock::time_point now);
  /// Sends what may be sent: @param send  is called with a follower and a message of it.
  template <class Send>
  void pump(const Send& send, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    for (auto& [client, follower] : attached_) {
      while (auto message = follower->stream.next(now)) send(*follower, *message);
    }
  }
  /// Clients (routing ids) whose messages have been waiting without credit for this long.
  [[nodiscard]] std::vector<std::string> stalled(Clock::duration most, Clock::time_point now) const;
  /// The one that has been so for longest; empty: none.
  [[nodiscard]] std::string most_stalled(Clock::time_point now) const;

  [[nodiscard]] bool empty() const { return attached_.empty(); }
  [[nodiscard]] std::size_t size() const;
  /// Those for which most waits or is unread, most first.
  [[nodiscard]] std::vector<FollowerUse> uses(std::size_t most, Clock::time_point now) const;

 private:
  struct Remembered {
    FollowedStream stream;
    std::string reason;
  };
  using Attached = std::unordered_map<std::string, std::unique_ptr<Follower>>;
  std::unique_ptr<Follower> detach(Attached::iterator found);  // with the lock
  void remember(std::unique_ptr<Follower> follower, std::string reason);
  [[nodiscard]] bool want(Follower& follower, const std::vector<Following::Topic>& topics,
                          std::vector<Following::Topic>& fresh);

  const std::uint64_t queue_bytes_;
  Subscriptions& subscriptions_;
  mutable std::mutex mutex_;  // of what follows
  Attached attached_;         // by routing id
  std::map<std::string, std::string> client_of_stream_;
  std::map<std::string, Remembered> remembered_;  // by key
  std::deque<std::string> remembered_order_;      // their keys, oldest first
};

}  // namespace limber::server
