#include "server/web/stream_queue.h"

#include <algorithm>
#include <utility>

namespace limber::server::web {

StreamQueue::Put StreamQueue::put(const std::string& topic, const SharedMessages& messages,
                                  TopicSlots::Keep keep) {
  if (messages->empty()) return Put::kTaken;
  std::uint64_t more = 0;
  for (const auto& bytes : *messages) more += cost(bytes);
  const bool is_ordered = keep == TopicSlots::Keep::kOrder;
  if (is_ordered && ordered_bytes_ + more > limit_) return Put::kOverflow;
  const auto [found, fresh] = topics_.try_emplace(topic);
  Topic& waiting = found->second;
  if (fresh) turns_.push_back(topic);
  waiting.keep = keep;
  if (!is_ordered) give_up(waiting);
  for (const auto& bytes : *messages)
    waiting.messages.emplace_back(messages, &bytes);  // shares the ownership of all
  waiting.bytes += more;
  bytes_ += more;
  if (is_ordered) ordered_bytes_ += more;
  make_room_beside(topic);
  return Put::kTaken;
}

void StreamQueue::give_up(Topic& topic) {
  bytes_ -= topic.bytes;
  topic.bytes = 0;
  given_up_ += topic.messages.size();
  topic.messages.clear();
}

const std::string* StreamQueue::largest() const {
  const std::string* found = nullptr;
  std::uint64_t most = 0;
  for (const auto& [name, topic] : topics_) {
    if (topic.keep == TopicSlots::Keep::kOrder || topic.bytes <= most) continue;
    found = &name;
    most = topic.bytes;
  }
  return found;
}

void StreamQueue::make_room_beside(const std::string& topic) {
  while (const std::string* most = largest()) {
    if (bytes_ - topics_.at(*most).bytes <= limit_) return;
    auto turn = std::find_if(turns_.begin(), turns_.end(), [&](const std::string& name) {
      return name != topic && name != *most && topics_.at(name).keep == TopicSlots::Keep::kNewest;
    });
    if (turn == turns_.end()) turn = std::find(turns_.begin(), turns_.end(), *most);
    const auto found = topics_.find(*turn);
    give_up(found->second);
    topics_.erase(found);
    turns_.erase(turn);
  }
}

std::optional<StreamQueue::Message> StreamQueue::take() {
  if (turns_.empty()) return std::nullopt;
  std::string topic = std::move(turns_.front());
  turns_.pop_front();
  const auto found = topics_.find(topic);
  Topic& waiting = found->second;
  std::shared_ptr<const StreamBytes> bytes = std::move(waiting.messages.front());
  waiting.messages.pop_front();
  bytes_ -= cost(*bytes);
  waiting.bytes -= cost(*bytes);
  if (waiting.keep == TopicSlots::Keep::kOrder) ordered_bytes_ -= cost(*bytes);
  if (waiting.messages.empty()) {
    topics_.erase(found);
  } else {
    turns_.push_back(topic);
  }
  return Message{std::move(topic), std::move(bytes)};
}

void StreamQueue::clear() {
  topics_.clear();
  turns_.clear();
  bytes_ = ordered_bytes_ = 0;
}

}  // namespace limber::server::web
