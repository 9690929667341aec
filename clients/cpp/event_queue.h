#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "limber/v1/stream.pb.h"

namespace limber::client {

/// A message of the stream.
struct StreamEvent {
  std::string topic;
  v1::StreamMessage message;
  /// Messages of this topic lost just before this one, by the gap in their sequence numbers or
  /// because this client did not read them in time.
  std::uint64_t missed = 0;
};

/// Unread arrivals: of each topic the newest. One thread fills it, one reads.
class EventQueue {
 public:
  /// @param most  messages of one topic, >= 1; a motion may have megabytes
  explicit EventQueue(std::size_t most) : most_(most) {}

  /// In the place of the oldest of its topic if that has its share.
  void push(StreamEvent event);
  /// The oldest, or nothing after the timeout.
  [[nodiscard]] std::optional<StreamEvent> pop(std::chrono::milliseconds timeout);

 private:
  void drop_oldest(const std::string& topic);

  std::size_t most_;
  std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<StreamEvent> events_;
};

}  // namespace limber::client
