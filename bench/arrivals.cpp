#include "bench/arrivals.h"

#include <iterator>
#include <stdexcept>

namespace limber::bench {

Arrivals::Arrivals(LiveClient& client, const ServerProcess& server, const std::string& session)
    : stream_(client.context(), server) {
  stream_.subscribe("session/" + session + "/body/0/coordinates");
  thread_ = std::thread([this] { read(); });
}

Arrivals::~Arrivals() {
  is_ending_.store(true);
  thread_.join();
}

Arrivals::Times Arrivals::of(std::uint64_t revision) {
  std::unique_lock lock(mutex_);
  arrived_.wait(lock, [&] { return converged_revision_ >= revision || !fault_.empty(); });
  if (!fault_.empty()) throw std::runtime_error(fault_);
  const auto first = first_.lower_bound(revision);
  const Times times{first->second, converged_};
  first_.erase(first_.begin(), std::next(first));
  return times;
}

bool Arrivals::first_of(std::uint64_t revision, std::chrono::milliseconds patience,
                        Clock::time_point& first) {
  std::unique_lock lock(mutex_);
  const bool is_there = arrived_.wait_for(lock, patience, [&] {
    return first_.lower_bound(revision) != first_.end() || !fault_.empty();
  });
  if (!fault_.empty()) throw std::runtime_error(fault_);
  if (!is_there) return false;
  const auto found = first_.lower_bound(revision);
  first = found->second;
  first_.erase(first_.begin(), found);
  return true;
}

void Arrivals::read() {
  try {
    while (!is_ending_.load()) {
      if (!stream_.has_next(std::chrono::milliseconds(100))) continue;
      const limber::v1::Frames frames = stream_.next_frames();
      const auto now = Clock::now();
      const std::lock_guard lock(mutex_);
      first_.try_emplace(frames.result().revision(), now);
      if (frames.result().converged() && frames.result().revision() > converged_revision_) {
        converged_revision_ = frames.result().revision();
        converged_ = now;
      }
      arrived_.notify_all();
    }
  } catch (const std::exception& fault) {
    const std::lock_guard lock(mutex_);
    fault_ = fault.what();
    arrived_.notify_all();
  }
}

}  // namespace limber::bench
