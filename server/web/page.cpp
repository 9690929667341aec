#include "server/web/page.h"

#include <fmt/format.h>

#include <utility>

namespace limber::server::web {
namespace {

// Limits for a page's messages to the transport's thread; one more message may exceed the bytes.
constexpr std::size_t kMessagesUnderWay = 64, kBytesUnderWay = 1u << 20;

}  // namespace

void Page::open(std::function<void()> wake) {
  {
    const std::lock_guard lock(mutex_);
    wake_ = std::move(wake);
  }
  number_ = transport_.join(shared_from_this(), role_);
}

void Page::leave() {
  {
    const std::lock_guard lock(mutex_);
    if (has_left_) return;
    has_left_ = true;
    wake_ = nullptr;
    clear();
  }
  if (number_ != 0) transport_.leave(number_);
}

void Page::receive(std::string message) {
  {
    const std::lock_guard lock(mutex_);
    if (has_left_) return;
    ++messages_under_way_;
    bytes_under_way_ += message.size();
  }
  hand_over(number_, std::move(message));
}

bool Page::is_full() const {
  const std::lock_guard lock(mutex_);
  return has_much_under_way();
}

bool Page::has_much_under_way() const {
  return messages_under_way_ >= kMessagesUnderWay || bytes_under_way_ >= kBytesUnderWay;
}

std::optional<Closing> Page::closing() const {
  const std::lock_guard lock(mutex_);
  return closing_;
}

/// Under one lock: what fills the page between a look and the change would never be read on.
void Page::taken(std::size_t bytes) {
  bool was_full = false;
  {
    const std::lock_guard lock(mutex_);
    was_full = has_much_under_way();
    --messages_under_way_;
    bytes_under_way_ -= bytes;
  }
  if (was_full) wake();
}

void Page::cut_off(const std::string& reason) { close({kPolicy, reason}); }

void Page::close(Closing closing) {
  {
    const std::lock_guard lock(mutex_);
    if (closing_ || has_left_) return;
    closing_ = std::move(closing);
    clear();
  }
  wake();
}

void Page::wake() {
  std::function<void()> wake;
  {
    const std::lock_guard lock(mutex_);
    wake = wake_;
  }
  if (wake) wake();
}

void RequestPage::hand_over(std::uint64_t number, std::string message) {
  transport().ask(number, std::move(message));
}

void RequestPage::reply(std::string bytes, UnreadReplies::Hold unread) {
  auto reply = std::make_shared<const Reply>(Reply{std::move(bytes), std::move(unread)});
  bool is_first = false;
  {
    const std::lock_guard lock(mutex_);
    if (has_ended()) return;
    is_first = replies_.empty();
    replies_.push_back(std::move(reply));
  }
  if (is_first) wake();
}

std::optional<Page::Message> RequestPage::next() {
  const std::lock_guard lock(mutex_);
  if (replies_.empty()) return std::nullopt;
  const auto reply = std::move(replies_.front());
  replies_.pop_front();
  return Message{{}, reply->bytes, reply};
}

void StreamPage::hand_over(std::uint64_t number, std::string message) {
  transport().subscribe(number, std::move(message));
}

void StreamPage::publish(const std::string& topic, const SharedMessages& messages,
                         TopicSlots::Keep keep) {
  bool is_first = false;
  StreamQueue::Put put = StreamQueue::Put::kTaken;
  {
    const std::lock_guard lock(mutex_);
    if (has_ended()) return;
    is_first = queue_.empty();
    const std::uint64_t before = queue_.given_up();
    put = queue_.put(topic, messages, keep);
    counters_.replaced.fetch_add(queue_.given_up() - before, std::memory_order_relaxed);
    if (put == StreamQueue::Put::kTaken)
      counters_.web_published.fetch_add(messages->size(), std::memory_order_relaxed);
    note_bytes();
  }
  if (put == StreamQueue::Put::kOverflow) {
    counters_.cut_off.fetch_add(1, std::memory_order_relaxed);
    close({kTryAgain, fmt::format("more than {} bytes of '{}' wait unread", queue_bytes_, topic)});
  } else if (is_first) {
    wake();
  }
}

void StreamPage::note_bytes() {
  const std::uint64_t bytes = queue_.bytes();
  counters_.web_queue_bytes.fetch_add(bytes - noted_bytes_, std::memory_order_relaxed);
  noted_bytes_ = bytes;
}

std::optional<Page::Message> StreamPage::next() {
  const std::lock_guard lock(mutex_);
  auto message = queue_.take();
  if (!message) return std::nullopt;
  note_bytes();
  std::string head(1, static_cast<char>(message->topic.size()));
  return Message{head + message->topic, *message->bytes, message->bytes};
}

}  // namespace limber::server::web
