#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "engine/session/core/executor.h"

namespace limber::session {

/// The one task of a session: on an executor when there is work, never twice at once, waited for
/// when the session closes. Its state belongs to the owner's mutex: "with the lock" means that one.
class SerialTask {
 public:
  enum class CloseNotification { kNone, kSent };
  enum class Wait { kUntilIdle, kNone };

  /// @param mutex  the owner's; must outlive this
  /// @param on_closed  called without the lock, once, when a close that is to be reported is
  /// complete
  /// @throws Error{kInvalidArgument} with field executor, if there is none
  SerialTask(std::mutex& mutex, Executor executor, std::function<void()> on_closed);

  // With the lock:
  [[nodiscard]] bool is_pending() const { return posted_ || running_; }
  [[nodiscard]] bool is_running() const { return running_; }
  [[nodiscard]] bool is_closed() const { return closed_; }
  /// Whether the task would run sooner or later as one of this urgency.
  [[nodiscard]] bool would_change(Urgency urgency) const {
    return executor_.distinguishes() && urgency != urgency_;
  }
  /// Whether the calling thread is inside of the task.
  [[nodiscard]] bool is_current() const {
    return running_ && worker_ == std::this_thread::get_id();
  }

  /// Sees to it that `run` is called, unless it is pending already or all is closed. Takes the
  /// lock, leaves without it. If the executor refuses or drops a task, the next call posts it
  /// again. One that waits as a patient task and has become urgent is posted anew.
  /// @param run  begins with begin() and ends with finish(); keeps the owner alive
  /// @param message  gets the reason where the executor took nothing, with the lock
  void post(std::unique_lock<std::mutex> lock, std::function<void()> run, std::string& message,
            Urgency urgency = Urgency::kPrompt);
  /// The task's last deed, instead of finish(), where it is to go on as another one: as post().
  void repost(std::unique_lock<std::mutex> lock, std::function<void()> run, std::string& message,
              Urgency urgency);

  /// Without the lock, the task's first deed. @returns false where it must leave at once
  [[nodiscard]] bool begin();
  /// Takes the lock: the task's last deed, in the same breath as finding nothing to do.
  void finish(std::unique_lock<std::mutex> lock);
  /// Takes the lock. Returns when no task runs any more; called by the task itself or with
  /// Wait::kNone, at once, and finish() reports it.
  void close(std::unique_lock<std::mutex> lock, CloseNotification notification,
             Wait wait = Wait::kUntilIdle);

 private:
  class Ticket;
  void give(std::unique_lock<std::mutex> lock, std::function<void()> run, std::string& message,
            Urgency urgency);
  void notify_closed(std::unique_lock<std::mutex>& lock);

  std::mutex& mutex_;
  const Executor executor_;
  const std::function<void()> on_closed_;
  std::condition_variable idle_;  // running_ has become false
  bool posted_ = false, running_ = false;
  Urgency urgency_ = Urgency::kPrompt;  // of the task that was posted last
  std::uint64_t number_ = 0;            // of that task: those before it do nothing any more
  bool closed_ = false, is_close_reported_ = false, was_close_reported_ = false;
  std::thread::id worker_;
};

}  // namespace limber::session
