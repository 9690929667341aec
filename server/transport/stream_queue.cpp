#include "server/transport/stream_queue.h"

#include <algorithm>
#include <utility>

namespace limber::server {

StreamQueue::Put StreamQueue::put(const std::string& topic, const SharedMessages& messages,
                                  TopicSlots::Keep keep) {
  if (messages->empty()) return Put::kTaken;
  std::uint64_t more = 0;
  for (const auto& bytes : *messages) more += cost(bytes);
  const Part part = part_of(keep);
  if (part == Part::kAfter && bytes_of(part) + more > limit_) return Put::kOverflow;
  const auto [found, fresh] = topics_.try_emplace(topic);
  Topic& waiting = found->second;
  if (fresh) turns_.push_back(topic);
  waiting.keep = keep;
  if (keep != TopicSlots::Keep::kOrder) give_up(waiting);
  for (const auto& bytes : *messages)  // each shares the ownership of all
    waiting.messages.push_back({std::shared_ptr<const StreamBytes>(messages, &bytes), part});
  waiting.bytes += more;
  bytes_of(part) += more;
  make_room_beside(topic);
  return Put::kTaken;
}

void StreamQueue::put_newest(const std::string& topic, const SharedMessages& messages,
                             TopicSlots::Keep keep) {
  if (put(topic, messages, keep) == Put::kTaken) return;
  std::erase_if(turns_, [this](const std::string& name) {
    const auto found = topics_.find(name);
    if (found->second.keep == TopicSlots::Keep::kNewest) return false;
    give_up(found->second);
    topics_.erase(found);
    return true;
  });
  put(topic, messages, keep);
}

StreamQueue::Part StreamQueue::part_of(TopicSlots::Keep keep) const {
  if (keep == TopicSlots::Keep::kNewest) return Part::kNewest;
  if (keep == TopicSlots::Keep::kBegin) return Part::kBegin;
  const bool none_waits = bytes_of(Part::kFirst) == 0 && bytes_of(Part::kAfter) == 0;
  return none_waits ? Part::kFirst : Part::kAfter;
}

StreamQueue::Waiting StreamQueue::take_first(Topic& topic) {
  Waiting first = std::move(topic.messages.front());
  topic.messages.pop_front();
  topic.bytes -= cost(*first.bytes);
  bytes_of(first.part) -= cost(*first.bytes);
  return first;
}

void StreamQueue::give_up(Topic& topic) {
  for (; !topic.messages.empty(); ++given_up_) take_first(topic);
}

const std::string* StreamQueue::largest() const {
  const std::string* found = nullptr;
  std::uint64_t most = 0;
  for (const auto& [name, topic] : topics_) {
    if (topic.keep != TopicSlots::Keep::kNewest || topic.bytes <= most) continue;
    found = &name;
    most = topic.bytes;
  }
  return found;
}

void StreamQueue::make_room_beside(const std::string& topic) {
  while (const std::string* most = largest()) {
    const std::uint64_t counted = bytes_of(Part::kNewest) + bytes_of(Part::kAfter);
    if (counted - topics_.at(*most).bytes <= limit_) return;
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
  const TopicSlots::Keep keep = waiting.keep;
  Waiting first = take_first(waiting);
  if (waiting.messages.empty()) {
    topics_.erase(found);
  } else {
    turns_.push_back(topic);
  }
  return Message{std::move(topic), std::move(first.bytes), first.part, keep};
}

void StreamQueue::put_back(Message&& message) {
  const auto [found, gone] = topics_.try_emplace(message.topic);
  if (!gone) turns_.pop_back();  // take() had put it there
  turns_.push_front(std::move(message.topic));
  Topic& waiting = found->second;
  waiting.keep = message.keep;
  const std::uint64_t bytes = cost(*message.bytes);
  waiting.messages.push_front({std::move(message.bytes), message.part});
  waiting.bytes += bytes;
  bytes_of(message.part) += bytes;
}

bool StreamQueue::has_spare() const {
  return std::any_of(topics_.begin(), topics_.end(),
                     [](const auto& one) { return has_spare(one.second); });
}

void StreamQueue::give_up_spare() {
  for (auto& [name, topic] : topics_) {
    for (; has_spare(topic); ++given_up_) take_first(topic);
  }
}

void StreamQueue::clear() {
  for (const auto& [name, topic] : topics_) given_up_ += topic.messages.size();
  topics_.clear();
  turns_.clear();
  bytes_.fill(0);
}

}  // namespace limber::server
