#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/job.h"
#include "engine/session/core/executor.h"
#include "engine/session/core/serial_task.h"

namespace limber::session {

/// Checks final results on a task of its own, next to the session's task, which publishes the
/// findings so that results keep their order. Newer edits interrupt it. Its state belongs to the
/// owner's mutex: "with the lock" means that one.
/// @tparam Request  the subject of the check, in addition to the result itself or containing it
template <class Result, class Finding, class Request = std::shared_ptr<const Result>>
class BackgroundCheck {
 public:
  using SharedResult = std::shared_ptr<const Result>;
  /// Throws Error{kCancelled} where it is interrupted, anything else where nothing can be found.
  using Find = std::function<Finding(const Request&, const JobContext&)>;
  struct Found {
    SharedResult result;
    std::optional<Finding> finding;
    std::string failure;  // where there is no finding: why
  };

  /// @param mutex  the owner's; must outlive this
  /// @param find  called on the check's task
  /// @param on_found  called there without the lock: there is something to take()
  /// @param urgency  of its task: kPatient, kLong or kIdle
  BackgroundCheck(std::mutex& mutex, Executor executor, Find find, std::function<void()> on_found,
                  Urgency urgency = Urgency::kPatient)
      : mutex_(mutex),
        task_(mutex, std::move(executor), [] {}),
        find_(std::move(find)),
        on_found_(std::move(on_found)),
        urgency_(urgency) {}

  /// With the lock: this result's check was not begun.
  [[nodiscard]] bool is_new(const Result& result) const { return result.sequence != begun_for_; }

  /// With the lock: the next begin() is of this result, unless stop() comes before it. The owner
  /// may leave the lock in between, to make the request.
  void claim(const Result& result) {
    begun_for_ = result.sequence;
    cancellation_ = {};
  }

  /// With the lock, which it takes and may leave without; after claim().
  /// @param owner  kept alive by the task
  void begin(std::unique_lock<std::mutex>& lock, const SharedResult& result, Request request,
             std::shared_ptr<void> owner) {
    if (is_new(*result)) return;  // an edit was quicker
    waiting_ = Waiting{result, std::move(request)};
    std::string refused;
    task_.post(
        std::move(lock), [this, owner = std::move(owner)] { run(); }, refused, urgency_);
    if (refused.empty()) return;
    lock = std::unique_lock(mutex_);
    if (is_new(*result)) return;  // an edit came while the executor refused
    waiting_.reset();
    found_ = Found{result, {}, std::move(refused)};
  }

  /// With the lock: what runs or was found is out of date.
  void stop() {
    cancellation_.request();
    waiting_.reset();
    found_.reset();
    begun_for_ = 0;
  }

  /// With the lock.
  [[nodiscard]] std::optional<Found> take() { return std::exchange(found_, std::nullopt); }

  /// Without the lock.
  void close(SerialTask::Wait wait) {
    task_.close(std::unique_lock(mutex_), SerialTask::CloseNotification::kNone, wait);
  }

 private:
  struct Waiting {
    SharedResult result;
    Request request;
  };

  void run() {
    if (!task_.begin()) return;
    std::unique_lock lock(mutex_);
    while (waiting_ && !task_.is_closed()) {
      const Waiting taken = *std::exchange(waiting_, std::nullopt);
      const Cancellation cancellation = cancellation_;
      lock.unlock();
      std::optional<Found> found = find(taken, cancellation);
      lock.lock();
      if (found && !cancellation.requested()) found_ = std::move(found);
    }
    const bool has_news = found_.has_value();
    task_.finish(std::move(lock));
    if (has_news) on_found_();
  }

  /// @returns nothing where it was cancelled
  std::optional<Found> find(const Waiting& taken, const Cancellation& cancellation) const {
    Found found{taken.result, {}, {}};
    try {
      found.finding = find_(taken.request, JobContext{cancellation, {}});
    } catch (const Error& error) {
      if (error.code() == ErrorCode::kCancelled) return std::nullopt;
      found.failure = error.what();
    } catch (const std::exception& error) {
      found.failure = error.what();
    } catch (...) {
      found.failure = "unknown exception";
    }
    return found;
  }

  std::mutex& mutex_;
  SerialTask task_;
  const Find find_;
  const std::function<void()> on_found_;
  const Urgency urgency_;
  // With the lock:
  std::uint64_t begun_for_ = 0;     // sequence of the result under check; 0: none
  Cancellation cancellation_;       // of that check
  std::optional<Waiting> waiting_;  // begun, and not taken by the task yet
  std::optional<Found> found_;
};

}  // namespace limber::session
