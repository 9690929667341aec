#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>

#include "server/transport/local_peers.h"

namespace limber::server {

/// Stream messages that wait for one page or follower, bounded by their bytes. In topics where
/// newer messages replace older ones, the newest publication stays; topics in order stay whole,
/// from the newest publication of kBegin. Topics take turns, a message each. Not thread-safe.
class StreamQueue {
 public:
  /// Overhead of a message besides its bytes.
  static constexpr std::uint64_t kMessageBytes = 256;

  explicit StreamQueue(std::uint64_t limit) : limit_(limit) {}

  enum class Put {
    kTaken,
    kOverflow,  // messages in order would pass the limit; nothing was put
  };
  /// Makes room where the limit is passed, by giving up what waits of other topics of kNewest, the
  /// one that is next first. The largest publication of kNewest that waits does not count: it may
  /// be larger than the limit, and still reaches a page that is slow. For the same reason neither
  /// counts what begins a topic in order, nor a publication in order before which none waits.
  Put put(const std::string& topic, const SharedMessages& messages, TopicSlots::Keep keep);
  /// As put(), for receivers that can do without waiting messages: if messages in order would pass
  /// the limit, all waiting ones in order are given up.
  void put_newest(const std::string& topic, const SharedMessages& messages, TopicSlots::Keep keep);

  /// Class of a message, by its bound.
  enum class Part : std::uint8_t {
    kNewest,
    kBegin,  // of one publication a topic
    kFirst,  // of one publication of kOrder, which found none waiting
    kAfter,  // of kOrder, too: within the limit
  };
  struct Message {
    std::string topic;
    std::shared_ptr<const StreamBytes> bytes;
    // How it waited, for put_back().
    Part part = Part::kNewest;
    TopicSlots::Keep keep = TopicSlots::Keep::kNewest;
  };
  /// The next one.
  std::optional<Message> take();
  /// It is the next one again, as if it had not been taken. Nothing may have been put since.
  void put_back(Message&& message);

  /// Messages in order that a newer one of their topic replaces: all except one that begins a topic
  /// or, if that is continued already, the newest one. The receiver of that one detects the missing
  /// ones. Of kNewest there are none.
  [[nodiscard]] bool has_spare() const;
  /// Gives those up.
  void give_up_spare();
  /// Gives up all that waits.
  void clear();
  [[nodiscard]] bool empty() const { return turns_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const {
    return std::accumulate(bytes_.begin(), bytes_.end(), std::uint64_t{0});
  }
  /// Messages that were given up, since the start.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }

 private:
  struct Waiting {
    std::shared_ptr<const StreamBytes> bytes;
    Part part = Part::kNewest;
  };
  struct Topic {
    std::deque<Waiting> messages;
    TopicSlots::Keep keep = TopicSlots::Keep::kNewest;
    std::uint64_t bytes = 0;
  };
  static std::uint64_t cost(const StreamBytes& bytes) { return bytes.size() + kMessageBytes; }
  [[nodiscard]] Part part_of(TopicSlots::Keep keep) const;
  [[nodiscard]] std::uint64_t& bytes_of(Part part) {
    return bytes_[static_cast<std::size_t>(part)];
  }
  [[nodiscard]] std::uint64_t bytes_of(Part part) const {
    return bytes_[static_cast<std::size_t>(part)];
  }
  [[nodiscard]] static bool has_spare(const Topic& topic) {
    return topic.keep == TopicSlots::Keep::kOrder && topic.messages.size() > 1;
  }
  Waiting take_first(Topic& topic);
  void give_up(Topic& topic);
  void make_room_beside(const std::string& topic);
  [[nodiscard]] const std::string* largest() const;  // of kNewest; null: there is none

  std::uint64_t limit_;
  std::map<std::string, Topic> topics_;   // those that have messages
  std::deque<std::string> turns_;         // of topics_
  std::array<std::uint64_t, 4> bytes_{};  // by Part
  std::uint64_t given_up_ = 0;
};

}  // namespace limber::server
