#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "engine/session/core/executor.h"

namespace limber::session::contract {

/// Keeps the tasks that sessions post until the test runs them, on the test's thread. Tasks may be
/// posted from any thread. Outlives the sessions.
class ManualExecutor {
 public:
  enum class Mode {
    kKeep,    // tasks wait until they are run
    kDrop,    // tasks are destroyed without having run
    kRefuse,  // throws std::runtime_error("full")
  };

  [[nodiscard]] Executor executor() {
    return [this](std::function<void()> task) { take(std::move(task)); };
  }
  /// Keeps prompt tasks and those that refine; patient ones are kept by `patient`.
  [[nodiscard]] Executor executor(ManualExecutor& patient) { return executor(*this, patient); }
  [[nodiscard]] Executor executor(ManualExecutor& refining, ManualExecutor& patient) {
    return [this, &refining, &patient](std::function<void()> task, Urgency urgency) {
      const bool is_prompt = urgency == Urgency::kPrompt;
      (is_prompt                       ? *this
       : urgency == Urgency::kRefining ? refining
                                       : patient)
          .take(std::move(task));
    };
  }
  void set_mode(Mode mode) {
    const std::lock_guard lock(mutex_);
    mode_ = mode;
  }

  /// Runs the oldest task. @returns false where none waits
  bool run_one() {
    std::function<void()> task;
    {
      const std::lock_guard lock(mutex_);
      if (tasks_.empty()) return false;
      task = std::move(tasks_.front());
      tasks_.pop_front();
      ++running_;
    }
    task();
    const std::lock_guard lock(mutex_);
    --running_;
    return true;
  }
  /// Until no task waits, those that tasks post included.
  void run_all() {
    while (run_one()) {
    }
  }
  /// Destroys the waiting tasks.
  void drop_all() { (void)take_all(); }

  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return tasks_.size();
  }
  /// The most tasks that waited at once, with those that ran meanwhile.
  [[nodiscard]] std::size_t most_pending() const {
    const std::lock_guard lock(mutex_);
    return most_pending_;
  }
  /// The most tasks that waited at once.
  [[nodiscard]] std::size_t most_waiting() const {
    const std::lock_guard lock(mutex_);
    return most_waiting_;
  }

 private:
  void take(std::function<void()> task) {
    const std::lock_guard lock(mutex_);
    if (mode_ == Mode::kRefuse) throw std::runtime_error("full");
    if (mode_ == Mode::kDrop) return;
    tasks_.push_back(std::move(task));
    most_waiting_ = std::max(most_waiting_, tasks_.size());
    most_pending_ = std::max(most_pending_, tasks_.size() + running_);
  }
  /// Tasks are destroyed without the lock: that takes the session's.
  std::deque<std::function<void()>> take_all() {
    const std::lock_guard lock(mutex_);
    return std::exchange(tasks_, {});
  }

  mutable std::mutex mutex_;
  Mode mode_ = Mode::kKeep;
  std::deque<std::function<void()>> tasks_;
  std::size_t running_ = 0, most_pending_ = 0, most_waiting_ = 0;
};

}  // namespace limber::session::contract
