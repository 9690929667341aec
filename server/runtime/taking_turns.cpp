#include "server/runtime/taking_turns.h"

#include <algorithm>
#include <utility>

namespace limber::server {

TakingTurns::~TakingTurns() {
  while (!clients_.empty()) {  // a task may be the last to hold a session, whose end asks for more
    const auto ending = std::exchange(clients_, {});
  }
}

void TakingTurns::put(const std::string& client, Task task, Share share) {
  const std::lock_guard lock(mutex_);
  Client& own = clients_[client];
  own.share = share;
  if (own.waiting.empty()) turns_.push_back(client);
  own.waiting.push_back(std::move(task));
}

std::optional<TakingTurns::Taken> TakingTurns::take() {
  const auto turn = std::find_if(turns_.begin(), turns_.end(), [&](const std::string& client) {
    const Client& own = clients_.at(client);
    return own.share == Share::kAll || own.running < free_;
  });
  if (turn == turns_.end()) {
    ++left_;
    return std::nullopt;
  }
  Taken taken{std::move(*turn), nullptr};
  turns_.erase(turn);
  Client& own = clients_.at(taken.client);
  taken.task = std::move(own.waiting.front());
  own.waiting.pop_front();
  if (!own.waiting.empty()) turns_.push_back(taken.client);
  ++own.running;
  --free_;
  return taken;
}

void TakingTurns::give_back(const std::string& client) {
  ++free_;
  const auto own = clients_.find(client);
  if (--own->second.running == 0 && own->second.waiting.empty()) clients_.erase(own);
}

void TakingTurns::run_one() {
  std::unique_lock lock(mutex_);
  auto taken = take();
  while (taken) {
    lock.unlock();
    taken->task();
    taken->task = nullptr;
    lock.lock();
    give_back(taken->client);
    if (left_ == 0) return;
    --left_;
    taken = take();
  }
}

}  // namespace limber::server
