#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>

namespace limber::server {

/// Tasks of many sessions, each at most one, for fewer threads than there are sessions.
/// Thread-safe.
///
/// The newest task goes first: with more to refine than there is time for, it is the one that is
/// least likely to be out of date before it is done, where the oldest is the most likely one. Every
/// fourth time the oldest goes first, so that none waits for ever.
class NewestFirst {
 public:
  using Task = std::function<void()>;
  class Place;

  NewestFirst() = default;
  ~NewestFirst();
  NewestFirst(const NewestFirst&) = delete;
  NewestFirst& operator=(const NewestFirst&) = delete;

  /// Of one session.
  [[nodiscard]] static std::shared_ptr<Place> place();
  /// In place of the one that waits there.
  void put(const std::shared_ptr<Place>& place, Task task);
  /// The one that waits there is not needed any more.
  void withdraw(const std::shared_ptr<Place>& place);
  /// Runs one that waits, if any does.
  void run_one();

 private:
  [[nodiscard]] Task take();

  std::mutex mutex_;
  std::list<std::shared_ptr<Place>> waiting_;  // newest first
  std::uint64_t taken_ = 0;
};

}  // namespace limber::server
