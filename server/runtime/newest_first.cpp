#include "server/runtime/newest_first.h"

#include <iterator>
#include <optional>
#include <utility>

namespace limber::server {

class NewestFirst::Place {
 public:
  Task task;
  std::optional<std::list<std::shared_ptr<Place>>::iterator> at;  // none: nothing waits
};

NewestFirst::~NewestFirst() {
  while (take()) {  // sessions and their tasks keep each other alive
  }
}

std::shared_ptr<NewestFirst::Place> NewestFirst::place() { return std::make_shared<Place>(); }

void NewestFirst::put(const std::shared_ptr<Place>& place, Task task) {
  const std::lock_guard lock(mutex_);
  place->task.swap(task);  // the older one goes without the lock: it may be the last of a session
  if (place->at) {
    waiting_.splice(waiting_.begin(), waiting_, *place->at);
  } else {
    waiting_.push_front(place);
  }
  place->at = waiting_.begin();
}

void NewestFirst::withdraw(const std::shared_ptr<Place>& place) {
  Task task;  // goes without the lock
  const std::lock_guard lock(mutex_);
  if (!place->at) return;
  waiting_.erase(*std::exchange(place->at, std::nullopt));
  task = std::exchange(place->task, nullptr);
}

NewestFirst::Task NewestFirst::take() {
  constexpr std::uint64_t kTurnOfOldest = 4;
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return nullptr;
  const bool is_turn_of_oldest = ++taken_ % kTurnOfOldest == 0;
  const auto at = is_turn_of_oldest ? std::prev(waiting_.end()) : waiting_.begin();
  const std::shared_ptr<Place> place = *at;
  waiting_.erase(at);
  place->at.reset();
  return std::exchange(place->task, nullptr);
}

void NewestFirst::run_one() {
  if (const Task task = take()) task();
}

}  // namespace limber::server
