#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/transport/stream_queue.h"

namespace limber::server {

/// Messages to one follower (follow.proto): sent against its credit, from a queue that is bounded
/// in bytes. Knows no sockets. Not thread-safe.
class FollowedStream {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint64_t kLeastWindow = 64u << 10, kWindow = 4u << 20,
                                 kLargestWindow = 64u << 20;

  /// @param queue_bytes  of what waits, as StreamQueue takes it
  explicit FollowedStream(std::uint64_t queue_bytes) : queue_(queue_bytes) {}

  /// @param wanted  0: kWindow; else it is brought within the bounds
  void set_window(std::uint64_t wanted);
  [[nodiscard]] std::uint64_t window() const { return window_; }

  void put(const std::string& topic, const SharedMessages& messages, TopicSlots::Keep keep,
           Clock::time_point now);

  /// Bytes that count as not written to the network as long as this lives. Any thread.
  class Unwritten {
   public:
    using Count = std::shared_ptr<std::atomic<std::uint64_t>>;
    Unwritten() = default;
    Unwritten(Count count, std::uint64_t bytes) : count_(std::move(count)), bytes_(bytes) {
      count_->fetch_add(bytes_, std::memory_order_relaxed);
    }
    Unwritten(Unwritten&&) noexcept = default;
    Unwritten& operator=(Unwritten&&) = delete;
    ~Unwritten() {
      if (count_) count_->fetch_sub(bytes_, std::memory_order_relaxed);
    }

   private:
    Count count_;
    std::uint64_t bytes_ = 0;
  };
  struct Message {
    std::string topic;
    std::shared_ptr<const StreamBytes> bytes;
    std::uint64_t sent_bytes = 0;  // StreamPosition
    std::uint64_t left_out = 0;
    Unwritten unwritten;
    // How it was before, for put_back().
    StreamQueue::Part part = StreamQueue::Part::kNewest;
    TopicSlots::Keep keep = TopicSlots::Keep::kNewest;
    std::uint64_t last_bytes = 0;
  };
  /// The next message, as long as fewer bytes than the window are unread, and not many more
  /// unwritten: a client may give credit for unread bytes. It counts as sent.
  [[nodiscard]] std::optional<Message> next(Clock::time_point now);

  /// The message that next() has just returned could not be sent: it waits again, before all
  /// others.
  void put_back(Message&& message, Clock::time_point now);
  /// Whether messages wait that newer ones in the queue replace (StreamQueue).
  [[nodiscard]] bool has_spare() const { return queue_.has_spare(); }
  /// Gives those up. One that has stalled still has. @returns the messages
  std::uint64_t give_up_spare();

  /// The client has read up to this position; one that was never reached counts as the newest.
  void credit(std::uint64_t read_bytes, Clock::time_point now);
  /// Its connection has ended: what waits is given up. Sent messages count as left out unless
  /// resume() confirms that they were read.
  void suspend();
  /// On a new connection.
  void resume(std::uint64_t read_bytes, Clock::time_point now);

  [[nodiscard]] std::uint64_t waiting_bytes() const { return queue_.bytes(); }
  [[nodiscard]] std::uint64_t unread_bytes() const { return sent_bytes_ - read_bytes_; }
  /// Its bytes in this process: waiting messages, and those not written to the network.
  [[nodiscard]] std::uint64_t held_bytes() const { return waiting_bytes() + unwritten_bytes(); }
  [[nodiscard]] std::uint64_t unwritten_bytes() const {
    return unwritten_->load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }
  /// Messages that were given up since it began.
  [[nodiscard]] std::uint64_t left_out() const { return lost_ + queue_.given_up(); }
  /// How long messages have been waiting without any credit.
  [[nodiscard]] Clock::duration stalled_for(Clock::time_point now) const;

 private:
  [[nodiscard]] bool may_send() const {
    return unread_bytes() < window_ && unwritten_bytes() < window_ + last_bytes_;
  }
  void note_stall(Clock::time_point now);

  StreamQueue queue_;
  std::uint64_t window_ = kWindow;
  std::uint64_t sent_bytes_ = 0, read_bytes_ = 0;
  // Bytes of the newest message: libzmq may hold it for a moment after the client has read it.
  std::uint64_t last_bytes_ = 0;
  Unwritten::Count unwritten_ = std::make_shared<std::atomic<std::uint64_t>>(0);
  std::deque<std::uint64_t> under_way_;  // positions of messages that are sent and not read
  std::uint64_t sent_ = 0, lost_ = 0;    // messages
  std::optional<Clock::time_point> stalled_since_;
};

}  // namespace limber::server
