#pragma once

#include <concepts>
#include <functional>
#include <utility>

namespace limber::session {

/// Who waits for a task: somebody who edits and sees nothing of it yet; somebody who sees a first
/// answer and waits for the final one; or nobody that close (first solves, checks, fits; the first
/// patient task of a session is its build); or nobody, for as long as a build may take or longer
/// (designs, other numbers of modes); or nobody who has asked for it (further starts). An executor
/// lets the first go before the second, and that before the others, of which long ones leave a
/// place to the patient, and idle ones of all sessions go one after the other.
enum class Urgency { kPrompt, kRefining, kPatient, kLong, kIdle };

/// Runs a task later on some thread. A session posts at most one task at a time, and those of
/// bodies and linkages one that checks final results besides, then those of bodies one that
/// compares numbers of modes.
class Executor {
 public:
  using Task = std::function<void()>;

  Executor() = default;
  /// @param run  takes a task; there is no difference between urgent ones and others
  template <std::invocable<Task> Run>
  Executor(Run run) : run_([run = std::move(run)](Task task, Urgency) { run(std::move(task)); }) {}
  /// @param run  takes a task and its urgency
  template <std::invocable<Task, Urgency> Run>
  Executor(Run run) : run_(std::move(run)), distinguishes_(true) {}

  void operator()(Task task, Urgency urgency = Urgency::kPrompt) const {
    run_(std::move(task), urgency);
  }
  [[nodiscard]] explicit operator bool() const { return static_cast<bool>(run_); }
  /// Whether a task that has become urgent, or no longer is, gains by being posted anew.
  [[nodiscard]] bool distinguishes() const { return distinguishes_; }

 private:
  std::function<void(Task, Urgency)> run_;
  bool distinguishes_ = false;
};

}  // namespace limber::session
