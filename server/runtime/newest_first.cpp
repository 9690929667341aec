#include "server/runtime/newest_first.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace limber::server {

struct NewestFirst::Waiting {
  std::shared_ptr<Place> place;
  Task task;
};

class NewestFirst::Place {
 public:
  std::vector<std::list<Waiting>::iterator> waiting;
};

NewestFirst::NewestFirst() = default;

NewestFirst::~NewestFirst() {
  while (take()) {  // sessions and their tasks keep each other alive
  }
}

std::shared_ptr<NewestFirst::Place> NewestFirst::place() { return std::make_shared<Place>(); }

void NewestFirst::put(const std::shared_ptr<Place>& place, Task task) {
  const std::lock_guard lock(mutex_);
  waiting_.push_front({place, std::move(task)});
  place->waiting.push_back(waiting_.begin());
}

void NewestFirst::withdraw(const std::shared_ptr<Place>& place) {
  std::list<Waiting> gone;  // without the lock: a task may be the last to hold a session
  const std::lock_guard lock(mutex_);
  for (const auto& at : place->waiting) gone.splice(gone.begin(), waiting_, at);
  place->waiting.clear();
}

NewestFirst::Task NewestFirst::take() {
  constexpr std::uint64_t kTurnOfOldest = 4;
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return nullptr;
  const bool is_turn_of_oldest = ++taken_ % kTurnOfOldest == 0;
  const auto at = is_turn_of_oldest ? std::prev(waiting_.end()) : waiting_.begin();
  std::erase(at->place->waiting, at);
  Task task = std::move(at->task);
  waiting_.erase(at);
  return task;
}

void NewestFirst::run_one() {
  if (const Task task = take()) task();
}

}  // namespace limber::server
