#pragma once

#include <chrono>
#include <cstdint>
#include <list>
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

/// The state of a subscriber for a topic that it requests.
enum class Has {
  kNothing,
  kNewest,  // the newest message that was published; of prefixes of topics never said
};

/// A client's request to follow a stream (FollowRequest).
struct Following {
  struct Topic {
    std::string prefix;
    std::uint64_t after = 0;  // sequence of the newest message that was read of it; 0: none
  };
  std::string stream;
  std::vector<Topic> topics;
  std::uint64_t read_bytes = 0, window_bytes = 0;
  // The client, for display: its number, and its public name.
  std::uint64_t client = 0;
  std::string name;
};

struct FollowAnswer {
  bool continued = false;
  std::string cut_off;  // why it had ended; empty: it had not
  std::uint64_t left_out = 0, window_bytes = 0;
  enum class Taken {
    kYes,
    // These have no stream then:
    kTooManyStreams,   // of its connection
    kTooManyPrefixes,  // of all, and its connection has most
  } taken = Taken::kYes;
};

/// How one follower does.
struct FollowerUse {
  std::uint64_t client = 0;
  std::string name;
  std::uint32_t topics = 0;
  std::uint64_t waiting_bytes = 0, unread_bytes = 0, sent = 0, left_out = 0;
  double stalled_s = 0;
};

/// Followers of streams, and records of ended ones. One thread changes it, any may ask uses().
class Followers {
 public:
  using Clock = FollowedStream::Clock;
  /// Streams without a connection that are remembered, the newest.
  static constexpr std::size_t kMostRemembered = 1024;
  /// Streams of one connection: those of clients behind a proxy.
  static constexpr std::size_t kMostOfConnection = 256;

  struct Follower {
    std::uint64_t number = 0;  // as a subscriber (Subscriptions)
    std::uint64_t group = 0;   // those of its connection have the same (Subscriptions)
    std::string key;           // of the stream: its owner's key, and its name
    Address address;
    std::uint64_t client = 0;
    std::string name;
    std::set<std::string> prefixes;
    FollowedStream stream;
    bool is_answered = false;  // messages come behind the answer to the request that it began with

    /// Routing id of its connection, which may be a proxy's with others behind it.
    [[nodiscard]] const std::string& connection() const { return address.envelope.front(); }
    /// It came by a proxy, which added a frame of its own.
    [[nodiscard]] bool is_behind_proxy() const {
      return address.envelope.size() > 1 && !address.envelope[1].empty();
    }
  };

  Followers(std::uint64_t queue_bytes, Subscriptions& subscriptions)
      : queue_bytes_(queue_bytes), subscriptions_(subscriptions) {}

  struct Begun {
    FollowAnswer answer;
    Follower* follower = nullptr;  // null: it has ended
    /// Prefixes that are new to it, with their last read positions.
    std::vector<Following::Topic> fresh;
  };
  /// A stream is where its requests come from, by the frames before them: clients behind one proxy
  /// have one each.
  /// @param number  for a stream that is not there
  Begun follow(const Address& address, Following wanted, std::uint64_t number,
               Clock::time_point now);
  /// The answer to a request is on its way: messages may be.
  void note_answer(std::uint64_t number);
  [[nodiscard]] const Follower* of_number(std::uint64_t number) const;
  /// It is remembered, and told the reason when it comes again.
  void end(const Follower& follower, const std::string& reason);
  /// All of the connection with this routing id, in the same way.
  void end_connection(const std::string& connection, const std::string& reason);

  /// Into the queues of the subscribers. @returns messages that were given up for it
  std::uint64_t publish(const std::string& topic, const SharedMessages& messages,
                        TopicSlots::Keep keep, Clock::time_point now);
  enum class Sent { kYes, kFull };
  /// Sends what may be sent: @param send  is called with a follower and a message of it, which it
  /// may take unless it returns kFull. One that finds its connection full waits for the next time,
  /// with all behind it.
  template <class Send>
  void pump(const Send& send, Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    for (auto& [place, follower] : attached_) {
      if (!follower->is_answered) continue;
      while (auto message = follower->stream.next(now)) {
        if (send(*follower, *message) == Sent::kYes) continue;
        follower->stream.put_back(std::move(*message), now);
        break;
      }
    }
  }
  /// Followers whose messages have been waiting without credit for this long.
  [[nodiscard]] std::vector<const Follower*> stalled(Clock::duration most,
                                                     Clock::time_point now) const;
  /// The one that has been so for longest; null: none.
  [[nodiscard]] const Follower* most_stalled(Clock::time_point now) const;

  // Connections have equal shares of `limit`, however many streams each has. The largest follower
  // is, of the connection that holds most, and more than its share, the one that holds most.

  /// Gives up what the largest can do without (StreamQueue), of those for which there is such.
  /// @returns the messages that were given up
  std::uint64_t withhold(std::uint64_t limit);
  /// The largest, first of those that have stalled; null: none.
  [[nodiscard]] const Follower* largest(std::uint64_t limit, Clock::time_point now) const;

  [[nodiscard]] bool empty() const { return attached_.empty(); }
  [[nodiscard]] std::size_t size() const;
  /// Those for which most waits or is unread, most first.
  [[nodiscard]] std::vector<FollowerUse> uses(std::size_t most, Clock::time_point now) const;

 private:
  struct Remembered {
    FollowedStream stream;
    std::string reason;
    std::list<std::string>::iterator place;  // in remembered_order_
  };
  using Attached = std::unordered_map<std::string, std::unique_ptr<Follower>>;
  /// Origin of requests with these frames: no two envelopes give the same.
  [[nodiscard]] static std::string place_of(const Address& address);
  struct OfConnection {
    std::size_t streams = 0;
    std::uint64_t group = 0;
  };
  [[nodiscard]] OfConnection of_connection(const std::string& connection) const;  // with the lock
  template <class Condition>
  [[nodiscard]] Follower* largest_of(std::uint64_t limit, const Condition& condition) const;
  std::unique_ptr<Follower> detach(Attached::iterator found);  // with the lock
  void remember(std::unique_ptr<Follower> follower, std::string reason);
  void forget(std::map<std::string, Remembered>::iterator known);
  [[nodiscard]] bool want(Follower& follower, const std::vector<Following::Topic>& topics,
                          std::vector<Following::Topic>& fresh);

  const std::uint64_t queue_bytes_;
  Subscriptions& subscriptions_;
  mutable std::mutex mutex_;  // of what follows
  Attached attached_;         // by place_of()
  std::map<std::string, std::string> place_of_stream_;
  std::map<std::string, Remembered> remembered_;  // by key
  std::list<std::string> remembered_order_;       // of the same, the oldest first
};

}  // namespace limber::server
