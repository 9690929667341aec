#include "server/transport/topic_slots.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace limber::server {

std::size_t TopicSlots::put(const std::string& topic, const SharedMessages& messages,
                            Clock::time_point now, Keep keep) {
  if (messages->empty()) return 0;
  auto [slot, fresh] = slots_.try_emplace(topic);
  auto& waiting = slot->second.messages;
  std::size_t given_up = 0;
  if (keep == Keep::kNewest) {
    given_up = waiting.size();
    waiting.clear();
  }
  // The waiting time continues: a stuck subscriber must not be waited for again with every new
  // message.
  if (fresh) slot->second.waiting_since = now;
  for (const auto& bytes : *messages)
    waiting.emplace_back(messages, &bytes);  // shares the ownership of all
  for (; keep != Keep::kNewest && waiting.size() > std::max(kMostInOrder, messages->size());
       ++given_up)
    waiting.pop_front();
  return given_up;
}

void TopicSlots::flush(const Send& send, Clock::time_point now) {
  for (auto slot = slots_.begin(); slot != slots_.end();) {
    auto& [topic, content] = *slot;
    while (!content.messages.empty()) {
      const Force force = now - content.waiting_since >= patience_ ? Force::kYes : Force::kNo;
      if (send(topic, content.messages.front(), force) == Sent::kFull) break;
      content.messages.pop_front();
      content.waiting_since = now;
    }
    slot = content.messages.empty() ? slots_.erase(slot) : std::next(slot);
  }
}

}  // namespace limber::server
