#include "engine/session/core/serial_task.h"

#include <fmt/format.h>

#include <exception>
#include <memory>
#include <utility>

#include "engine/base/error.h"

namespace limber::session {

/// What an executor holds. If it goes away without having run, the session must know: it may be
/// asked to post again.
class SerialTask::Ticket {
 public:
  Ticket(SerialTask& task, std::function<void()> run, std::uint64_t number)
      : task_(task), run_(std::move(run)), number_(number) {}
  Ticket(const Ticket&) = delete;
  Ticket& operator=(const Ticket&) = delete;
  ~Ticket() {
    if (!run_) return;
    const std::lock_guard lock(task_.mutex_);
    if (number_ == task_.number_) task_.posted_ = false;
  }
  void run() {
    const std::function<void()> run = std::exchange(run_, nullptr);
    if (run && is_newest()) run();
  }

 private:
  [[nodiscard]] bool is_newest() const {
    const std::lock_guard lock(task_.mutex_);
    return number_ == task_.number_;
  }

  SerialTask& task_;  // alive as long as run_ is
  std::function<void()> run_;
  const std::uint64_t number_;
};

SerialTask::SerialTask(std::mutex& mutex, Executor executor, std::function<void()> on_closed)
    : mutex_(mutex), executor_(std::move(executor)), on_closed_(std::move(on_closed)) {
  if (!executor_)
    throw Error(ErrorCode::kInvalidArgument, "executor", "a session needs an executor");
}

void SerialTask::post(std::unique_lock<std::mutex> lock, std::function<void()> run,
                      std::string& message, Urgency urgency) {
  const bool is_overdue = urgency == Urgency::kPrompt && would_change(urgency);
  if (running_ || closed_ || (posted_ && !is_overdue)) return;
  give(std::move(lock), std::move(run), message, urgency);
}

void SerialTask::repost(std::unique_lock<std::mutex> lock, std::function<void()> run,
                        std::string& message, Urgency urgency) {
  if (closed_) return finish(std::move(lock));
  running_ = false;
  worker_ = {};
  idle_.notify_all();
  give(std::move(lock), std::move(run), message, urgency);
}

void SerialTask::give(std::unique_lock<std::mutex> lock, std::function<void()> run,
                      std::string& message, Urgency urgency) {
  posted_ = true;
  urgency_ = urgency;
  const std::uint64_t number = ++number_;
  lock.unlock();
  std::string reason;
  try {
    const auto ticket = std::make_shared<Ticket>(*this, std::move(run), number);
    executor_([ticket] { ticket->run(); }, urgency);
    return;
  } catch (const std::exception& error) {
    reason = error.what();
  } catch (...) {
    reason = "unknown exception";
  }
  // Accepted edits stay accepted; the next call tries again.
  lock.lock();
  posted_ = false;
  message = fmt::format("the executor took no task: {}", reason);
}

bool SerialTask::begin() {
  const std::lock_guard lock(mutex_);
  posted_ = false;
  if (closed_ || running_) return false;
  running_ = true;
  worker_ = std::this_thread::get_id();
  return true;
}

void SerialTask::finish(std::unique_lock<std::mutex> lock) {
  notify_closed(lock);
  running_ = false;
  worker_ = {};
  idle_.notify_all();
}

void SerialTask::close(std::unique_lock<std::mutex> lock, CloseNotification notification,
                       Wait wait) {
  closed_ = true;
  if (notification == CloseNotification::kSent) is_close_reported_ = true;
  // Called from a listener, by the task itself: it ends, and reports it, after the listener has
  // returned.
  if (is_current() || (running_ && wait == Wait::kNone)) return;
  idle_.wait(lock, [&] { return !running_; });
  notify_closed(lock);
}

void SerialTask::notify_closed(std::unique_lock<std::mutex>& lock) {
  if (!closed_ || !is_close_reported_ || std::exchange(was_close_reported_, true)) return;
  lock.unlock();
  on_closed_();
  lock.lock();
}

}  // namespace limber::session
