#pragma once

#include <concepts>
#include <functional>
#include <utility>

namespace limber::session {

/// How urgent a task is:
/// - kPrompt: a client edits and sees no answer yet
/// - kRefining: a client sees a first answer and waits for the final one
/// - kPatient: first solves, checks, fits; the first patient task of a session is its build
/// - kLong: may take as long as a build or longer (designs, other numbers of modes)
/// - kIdle: no client has requested it (further starts)
///
/// An executor runs the first kind before the second, and that before the others. Long tasks leave
/// a place to patient ones, and the idle tasks of all sessions run one after the other.
enum class Urgency { kPrompt, kRefining, kPatient, kLong, kIdle };

/// Runs a task later on some thread. A session posts at most one task at a time. Sessions of bodies
/// and linkages post one more that checks final results, and those of bodies a third that compares
/// numbers of modes.
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
