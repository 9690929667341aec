#include "server/runtime/taking_turns.h"

#include <utility>

namespace limber::server {

TakingTurns::~TakingTurns() {
  while (take()) {  // without the lock: a task may be the last to hold a session
  }
}

void TakingTurns::put(const std::string& client, Task task) {
  const std::lock_guard lock(mutex_);
  std::deque<Task>& own = waiting_[client];
  if (own.empty()) turns_.push_back(client);
  own.push_back(std::move(task));
}

TakingTurns::Task TakingTurns::take() {
  const std::lock_guard lock(mutex_);
  if (turns_.empty()) return nullptr;
  std::string client = std::move(turns_.front());
  turns_.pop_front();
  const auto own = waiting_.find(client);
  Task task = std::move(own->second.front());
  own->second.pop_front();
  if (own->second.empty()) {
    waiting_.erase(own);
  } else {
    turns_.push_back(std::move(client));
  }
  return task;
}

void TakingTurns::run_one() {
  if (const Task task = take()) task();
}

}  // namespace limber::server
