#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace limber::server {

/// One stream message, complete but for its topic.
using StreamBytes = std::string;
/// The transport appends as much to each, its sequence number.
inline constexpr std::size_t kSequenceBytes = 11;
/// Messages of one publication, shared by all pending sends.
using SharedMessages = std::shared_ptr<const std::vector<StreamBytes>>;
[[nodiscard]] inline SharedMessages shared(std::vector<StreamBytes> messages) {
  return std::make_shared<const std::vector<StreamBytes>>(std::move(messages));
}

/// Messages that wait to be sent, newest wins: one slot per topic. Unless its messages continue
/// each other, a publication replaces the rest of the one before it. A subscriber that does not
/// keep up gets newer frames, never an ever longer queue. Not thread-safe.
class TopicSlots {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Sent { kYes, kFull };
  /// Sends one message, or says that a subscriber's queue is full; with `force` always sends, past
  /// full queues.
  enum class Force { kNo, kYes };
  using Send = std::function<Sent(const std::string& topic,
                                  const std::shared_ptr<const StreamBytes>& bytes, Force force)>;

  explicit TopicSlots(std::chrono::milliseconds patience) : patience_(patience) {}

  /// Treatment of waiting messages of the topic.
  enum class Keep {
    kNewest,  // they are given up for newer ones
    kOrder,   // they stay before newer ones; beyond kMostInOrder the oldest go
    kBegin,   // as kOrder, of messages that need none before them
  };
  static constexpr std::size_t kMostInOrder = 64;

  /// @returns messages of the topic that were given up
  std::size_t put(const std::string& topic, const SharedMessages& messages, Clock::time_point now,
                  Keep keep = Keep::kNewest);

  /// Sends what can be sent. A topic whose subscriber stays full for longer than the patience is
  /// forced: the others get the message, the full one misses it.
  void flush(const Send& send, Clock::time_point now);

  [[nodiscard]] bool empty() const { return slots_.empty(); }

 private:
  struct Slot {
    std::deque<std::shared_ptr<const StreamBytes>> messages;
    Clock::time_point waiting_since;
  };
  std::chrono::milliseconds patience_;
  std::map<std::string, Slot> slots_;
};

}  // namespace limber::server
