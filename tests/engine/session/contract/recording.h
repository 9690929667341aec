#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "engine/session/bodies/session.h"

namespace limber::session::contract {

/// What every published result says about itself, for every kind.
struct ResultHeader {
  Revision revision = 0;
  std::uint64_t sequence = 0;
  bool is_final = false;
  bool solve_failed = false;
  bool is_cancelled = false;  // the status of its report
  bool is_amendment = false;  // a final result published again, with more known about it
  std::string message;
};

/// The notifications of a listener, and whether they follow the rules. The listener of a kind
/// inherits from this and reports each call; hooks are called inside of it, without a lock.
class Recording {
 public:
  using ResultHook = std::function<void(const ResultHeader&)>;
  using StateHook = std::function<void(State)>;
  using ProgressHook = std::function<void()>;

  void set_result_hook(ResultHook hook) { set(result_hook_, std::move(hook)); }
  void set_state_hook(StateHook hook) { set(state_hook_, std::move(hook)); }
  void set_progress_hook(ProgressHook hook) { set(progress_hook_, std::move(hook)); }

  [[nodiscard]] std::vector<ResultHeader> results() const { return get(results_); }
  [[nodiscard]] std::vector<State> states() const { return get(states_); }
  /// Of the last state.
  [[nodiscard]] std::string state_message() const { return get(state_message_); }
  /// Is a call of the listener running?
  [[nodiscard]] bool is_inside() const { return get(is_inside_); }
  /// Empty if the session kept to the rules: one call at a time; sequences from 1 without gaps;
  /// revisions that never go back; results only of a session that is ready; kClosed once and last.
  [[nodiscard]] std::string fault() const { return get(fault_); }

  /// Waits for a final result of at least this revision. @returns false after a minute
  bool wait_final(Revision revision) {
    return wait([&] {
      for (const ResultHeader& result : results_)
        if (result.is_final && result.revision >= revision) return true;
      return false;
    });
  }
  /// Waits until this is the last state. @returns false after a minute
  bool wait_state(State state) {
    return wait([&] { return !states_.empty() && states_.back() == state; });
  }

 protected:
  void note_progress() {
    const Turn turn(*this);
    call(progress_hook_);
  }
  void note_state(State state, const std::string& message) {
    const Turn turn(*this);
    {
      const std::lock_guard lock(mutex_);
      states_.push_back(state);
      state_message_ = message;
    }
    call(state_hook_, state);
  }
  void note_result(const ResultHeader& result) {
    const Turn turn(*this);
    {
      const std::lock_guard lock(mutex_);
      if (result.sequence != results_.size() + 1) fault_ += "gap in the sequence; ";
      if (!results_.empty() && result.revision < results_.back().revision)
        fault_ += "revision goes back; ";
      if (states_.empty() || states_.back() != State::kReady)
        fault_ += "result of a session that is not ready; ";
      results_.push_back(result);
    }
    call(result_hook_, result);
  }

 private:
  /// One call of the listener.
  class Turn {
   public:
    explicit Turn(Recording& recording) : recording_(recording) {
      const std::lock_guard lock(recording_.mutex_);
      if (recording_.is_inside_) recording_.fault_ += "two calls at once; ";
      if (!recording_.states_.empty() && recording_.states_.back() == State::kClosed)
        recording_.fault_ += "call after kClosed; ";
      recording_.is_inside_ = true;
    }
    ~Turn() {
      const std::lock_guard lock(recording_.mutex_);
      recording_.is_inside_ = false;
      recording_.changed_.notify_all();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Recording& recording_;
  };

  template <class Hook>
  void set(Hook& held, Hook hook) {
    const std::lock_guard lock(mutex_);
    held = std::move(hook);
  }
  template <class Value>
  [[nodiscard]] Value get(const Value& held) const {
    const std::lock_guard lock(mutex_);
    return held;
  }
  template <class Hook, class... Values>
  void call(const Hook& held, const Values&... values) {
    if (const Hook hook = get(held)) hook(values...);
  }
  template <class Condition>
  bool wait(const Condition& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60), condition);
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  ResultHook result_hook_;
  StateHook state_hook_;
  ProgressHook progress_hook_;
  std::vector<ResultHeader> results_;
  std::vector<State> states_;
  std::string state_message_, fault_;
  bool is_inside_ = false;
};

}  // namespace limber::session::contract
