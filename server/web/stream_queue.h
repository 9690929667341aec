#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "server/transport/local_peers.h"

namespace limber::server::web {

/// Stream messages that wait for one page, bounded by their bytes. Of topics where newer messages
/// replace older ones the newest publication stays; topics in order stay whole. Topics take turns,
/// a message each. Not thread-safe.
class StreamQueue {
 public:
  /// What a message costs besides its bytes.
  static constexpr std::uint64_t kMessageBytes = 256;

  explicit StreamQueue(std::uint64_t limit) : limit_(limit) {}

  enum class Put {
    kTaken,
    kOverflow,  // messages in order would pass the limit; nothing was put
  };
  /// Makes room where the limit is passed, by giving up what waits of other topics of kNewest, the
  /// one that is next first. The largest publication of kNewest that waits does not count: it may
  /// be larger than the limit, and still reaches a page that is slow.
  Put put(const std::string& topic, const SharedMessages& messages, TopicSlots::Keep keep);

  struct Message {
    std::string topic;
    std::shared_ptr<const StreamBytes> bytes;
  };
  /// The next one.
  std::optional<Message> take();

  void clear();
  [[nodiscard]] bool empty() const { return turns_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// Messages that were given up, since the start.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }

 private:
  struct Topic {
    std::deque<std::shared_ptr<const StreamBytes>> messages;
    TopicSlots::Keep keep = TopicSlots::Keep::kNewest;
    std::uint64_t bytes = 0;
  };
  static std::uint64_t cost(const StreamBytes& bytes) { return bytes.size() + kMessageBytes; }
  void give_up(Topic& topic);
  void make_room_beside(const std::string& topic);
  [[nodiscard]] const std::string* largest() const;  // of kNewest; null: there is none

  const std::uint64_t limit_;
  std::map<std::string, Topic> topics_;  // those that have messages
  std::deque<std::string> turns_;        // of topics_
  std::uint64_t bytes_ = 0, ordered_bytes_ = 0, given_up_ = 0;
};

}  // namespace limber::server::web
