#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>

namespace limber::server {

/// Tasks of many sessions, for fewer threads than there are sessions. Thread-safe.
///
/// The newest task goes first. If there is more to refine than there is time for, it is the least
/// likely to be out of date before it is done, and the oldest is the most likely. Every fourth time
/// the oldest goes first, so that none waits for ever.
class NewestFirst {
 public:
  using Task = std::function<void()>;
  class Place;

  NewestFirst();
  ~NewestFirst();
  NewestFirst(const NewestFirst&) = delete;
  NewestFirst& operator=(const NewestFirst&) = delete;

  /// Of one session.
  [[nodiscard]] static std::shared_ptr<Place> place();
  /// Beside what waits there: one that was given before may arrive behind a newer one, and then
  /// finds nothing to do.
  void put(const std::shared_ptr<Place>& place, Task task);
  /// The task that waits there is not needed any more.
  void withdraw(const std::shared_ptr<Place>& place);
  /// Runs one that waits, if any does.
  void run_one();

 private:
  struct Waiting;
  [[nodiscard]] Task take();

  std::mutex mutex_;
  std::list<Waiting> waiting_;  // newest first
  std::uint64_t taken_ = 0;
};

}  // namespace limber::server
