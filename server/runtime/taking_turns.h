#pragma once

#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>

namespace limber::server {

/// Tasks of many clients for few threads: clients take turns, each with its oldest task, so that
/// one that has asked for much holds up nobody else. Thread-safe.
class TakingTurns {
 public:
  using Task = std::function<void()>;

  TakingTurns() = default;
  ~TakingTurns();
  TakingTurns(const TakingTurns&) = delete;
  TakingTurns& operator=(const TakingTurns&) = delete;

  void put(const std::string& client, Task task);
  /// Runs one that waits, if any does.
  void run_one();

 private:
  [[nodiscard]] Task take();

  std::mutex mutex_;
  std::map<std::string, std::deque<Task>> waiting_;  // none is empty
  std::deque<std::string> turns_;                    // those of waiting_, the next one first
};

}  // namespace limber::server
