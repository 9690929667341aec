#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "server/transport/counters.h"
#include "server/transport/stream_queue.h"
#include "server/transport/transport.h"

namespace limber::server::web {

/// Why a WebSocket is closed: a status of RFC 6455, and a text of at most 123 bytes.
struct Closing {
  unsigned code = 1000;
  std::string reason;
};
inline constexpr unsigned kGoingAway = 1001, kUnsupported = 1003, kPolicy = 1008, kTooBig = 1009,
                          kTryAgain = 1013;

/// One WebSocket of a page as the transport sees it: what waits in both directions. Its own methods
/// are for the gateway's thread, those of LocalPeer for the transport's.
class Page : public LocalPeer, public std::enable_shared_from_this<Page> {
 public:
  /// @param role  what it may do
  Page(Transport& transport, Role role) : transport_(transport), role_(role) {}

  /// @param wake  called on any thread, when next(), closing() or is_full() may have changed
  void open(std::function<void()> wake);
  /// The connection has ended.
  void leave();

  /// A whole binary message has come.
  void receive(std::string message);
  /// No more may be received until earlier messages are handled.
  [[nodiscard]] bool is_full() const;
  /// Set once the connection is to be closed.
  [[nodiscard]] std::optional<Closing> closing() const;

  /// A message to send, of two parts.
  struct Message {
    std::string head;
    std::string_view body;
    std::shared_ptr<const void> owner;  // of the body, until it is written
  };
  [[nodiscard]] virtual std::optional<Message> next() = 0;

  void taken(std::size_t bytes) final;
  void reply(std::string, UnreadReplies::Hold) override {}
  void publish(const std::string&, const SharedMessages&, TopicSlots::Keep) override {}
  void cut_off(const std::string& reason) final;

 protected:
  /// Hands a message to the transport.
  virtual void hand_over(std::uint64_t number, std::string message) = 0;
  virtual void clear() = 0;  // with the lock
  void close(Closing closing);
  [[nodiscard]] bool has_much_under_way() const;                          // with the lock
  [[nodiscard]] bool has_ended() const { return has_left_ || closing_; }  // with the lock
  void wake();
  [[nodiscard]] Transport& transport() const { return transport_; }

  mutable std::mutex mutex_;  // of what follows, and of what heirs have

 private:
  Transport& transport_;
  const Role role_;
  std::uint64_t number_ = 0;  // the gateway's thread
  std::function<void()> wake_;
  bool has_left_ = false;
  std::size_t messages_under_way_ = 0, bytes_under_way_ = 0;
  std::optional<Closing> closing_;
};

/// Requests up, replies down.
class RequestPage final : public Page {
 public:
  using Page::Page;
  std::optional<Message> next() override;
  void reply(std::string bytes, UnreadReplies::Hold unread) override;

 private:
  struct Reply {
    std::string bytes;
    UnreadReplies::Hold unread;
  };
  void hand_over(std::uint64_t number, std::string message) override;
  void clear() override { replies_.clear(); }
  std::deque<std::shared_ptr<const Reply>> replies_;
};

/// Subscriptions up, topics and stream messages down.
class StreamPage final : public Page {
 public:
  StreamPage(Transport& transport, Role role, Counters& counters, std::uint64_t queue_bytes)
      : Page(transport, role),
        counters_(counters),
        queue_bytes_(queue_bytes),
        queue_(queue_bytes) {}
  ~StreamPage() override {
    counters_.web_queue_bytes.fetch_sub(noted_bytes_, std::memory_order_relaxed);
  }
  StreamPage(const StreamPage&) = delete;
  StreamPage& operator=(const StreamPage&) = delete;
  std::optional<Message> next() override;
  void publish(const std::string& topic, const SharedMessages& messages,
               TopicSlots::Keep keep) override;

 private:
  void hand_over(std::uint64_t number, std::string message) override;
  void clear() override {
    queue_.clear();
    note_bytes();
  }
  void note_bytes();  // with the lock
  Counters& counters_;
  const std::uint64_t queue_bytes_;
  StreamQueue queue_;
  std::uint64_t noted_bytes_ = 0;  // of the queue, in the counters
};

}  // namespace limber::server::web
