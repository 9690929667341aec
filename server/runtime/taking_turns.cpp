#include "server/runtime/taking_turns.h"

#include <algorithm>
#include <utility>

#include "engine/base/lent_place.h"

namespace limber::server {

TakingTurns::~TakingTurns() {
  while (!clients_.empty()) {  // a task may be the last to hold a session, whose end posts more
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

/// Of a task that runs.
class TakingTurns::Place : public PlaceOfTask {
 public:
  Place(TakingTurns& turns, std::string client) : turns_(turns), client_(std::move(client)) {}

  void lend() override {
    {
      const std::lock_guard lock(turns_.mutex_);
      turns_.give_back(client_);
      if (turns_.left_ == 0 || !turns_.more_) return;
      --turns_.left_;
    }
    turns_.more_();
  }
  void take_back() override {
    const std::lock_guard lock(turns_.mutex_);
    ++turns_.clients_[client_].running;
    --turns_.free_;
  }

 private:
  TakingTurns& turns_;
  const std::string client_;
};

std::optional<TakingTurns::Taken> TakingTurns::take() {
  const auto turn = std::find_if(turns_.begin(), turns_.end(), [&](const std::string& client) {
    const Client& own = clients_.at(client);
    if (own.share == Share::kOne && own.running > 0) return false;
    const std::ptrdiff_t left = own.share == Share::kPart ? 0 : 1;
    return free_ > 0 && (own.share == Share::kAll || own.running < free_ - left);
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
    {
      Place place(*this, taken->client);
      const InPlace in_place(place);
      taken->task();
      taken->task = nullptr;
    }
    lock.lock();
    give_back(taken->client);
    if (left_ == 0) return;
    --left_;
    taken = take();
  }
}

}  // namespace limber::server
