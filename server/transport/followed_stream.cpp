#include "server/transport/followed_stream.h"

#include <algorithm>
#include <utility>

namespace limber::server {

void FollowedStream::set_window(std::uint64_t wanted) {
  window_ = wanted == 0 ? kWindow : std::clamp(wanted, kLeastWindow, kLargestWindow);
}

void FollowedStream::put(const std::string& topic, const SharedMessages& messages,
                         TopicSlots::Keep keep, Clock::time_point now) {
  queue_.put_newest(topic, messages, keep);
  note_stall(now);
}

std::optional<FollowedStream::Message> FollowedStream::next(Clock::time_point now) {
  if (!may_send()) return std::nullopt;
  auto waiting = queue_.take();
  if (!waiting) return std::nullopt;
  const std::uint64_t bytes = waiting->topic.size() + waiting->bytes->size();
  sent_bytes_ += bytes;
  const std::uint64_t last_bytes = std::exchange(last_bytes_, bytes);
  ++sent_;
  under_way_.push_back(sent_bytes_);
  note_stall(now);
  return Message{std::move(waiting->topic),
                 std::move(waiting->bytes),
                 sent_bytes_,
                 left_out(),
                 Unwritten(unwritten_, bytes),
                 waiting->part,
                 waiting->keep,
                 last_bytes};
}

void FollowedStream::put_back(Message&& message, Clock::time_point now) {
  {
    Message back = std::move(message);  // counts as unwritten up to here
    under_way_.pop_back();
    sent_bytes_ -= back.topic.size() + back.bytes->size();
    last_bytes_ = back.last_bytes;
    --sent_;
    queue_.put_back({std::move(back.topic), std::move(back.bytes), back.part, back.keep});
  }
  note_stall(now);
}

std::uint64_t FollowedStream::give_up_spare() {
  const std::uint64_t before = left_out();
  queue_.give_up_spare();
  return left_out() - before;
}

void FollowedStream::credit(std::uint64_t read_bytes, Clock::time_point now) {
  const std::uint64_t read = std::min(read_bytes, sent_bytes_);
  if (read <= read_bytes_) return;
  read_bytes_ = read;
  const std::size_t before = under_way_.size();
  while (!under_way_.empty() && under_way_.front() <= read) under_way_.pop_front();
  // A client that reads a byte now and then counts as stalled.
  if (under_way_.size() < before) stalled_since_.reset();
  note_stall(now);
}

void FollowedStream::suspend() {
  queue_.clear();
  stalled_since_.reset();
}

void FollowedStream::resume(std::uint64_t read_bytes, Clock::time_point now) {
  credit(read_bytes, now);
  lost_ += under_way_.size();
  under_way_.clear();
  read_bytes_ = sent_bytes_;
  unwritten_ = std::make_shared<std::atomic<std::uint64_t>>(0);  // of another connection
  stalled_since_.reset();
}

FollowedStream::Clock::duration FollowedStream::stalled_for(Clock::time_point now) const {
  return stalled_since_ ? now - *stalled_since_ : Clock::duration::zero();
}

void FollowedStream::note_stall(Clock::time_point now) {
  const bool is_stalled = !queue_.empty() && !may_send();
  if (!is_stalled) {
    stalled_since_.reset();
  } else if (!stalled_since_) {
    stalled_since_ = now;
  }
}

}  // namespace limber::server
