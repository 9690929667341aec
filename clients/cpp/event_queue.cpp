#include "clients/cpp/event_queue.h"

#include <algorithm>
#include <utility>

namespace limber::client {

void EventQueue::push(StreamEvent event) {
  {
    const std::lock_guard lock(mutex_);
    const std::string topic = event.topic;
    events_.push_back(std::move(event));
    drop_oldest(topic);
  }
  filled_.notify_one();
}

void EventQueue::drop_oldest(const std::string& topic) {
  const auto is_of_topic = [&](const StreamEvent& event) { return event.topic == topic; };
  if (static_cast<std::size_t>(std::count_if(events_.begin(), events_.end(), is_of_topic)) <= most_)
    return;
  const auto oldest = std::find_if(events_.begin(), events_.end(), is_of_topic);
  const auto next = std::find_if(oldest + 1, events_.end(), is_of_topic);
  next->missed += oldest->missed + 1;
  events_.erase(oldest);
}

std::optional<StreamEvent> EventQueue::pop(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (!filled_.wait_for(lock, timeout, [&] { return !events_.empty(); })) return std::nullopt;
  StreamEvent event = std::move(events_.front());
  events_.pop_front();
  return event;
}

}  // namespace limber::client
