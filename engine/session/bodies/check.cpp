#include <fmt/format.h>

#include <utility>

#include "engine/base/clauses.h"
#include "engine/session/bodies/impl.h"

// A task of its own checks final results when nothing is left to solve. The session's task
// publishes the findings, so that results keep their order. A newer edit interrupts it.

namespace limber::session {

/// Called with the lock, by the session's task.
bool BodySession::Impl::is_check_due() const {
  return newest_ && newest_ == final_ && newest_->check == Check::kPending &&
         check_.is_new(*newest_) && problem_ && problem_->started();
}

bool BodySession::Impl::do_other_work(std::unique_lock<std::mutex>& lock) {
  is_solving_ = false;
  if (const auto found = check_.take()) {
    const bool is_newest = found->result == newest_;
    lock.unlock();
    if (is_newest) amend(*found);
    return true;
  }
  if (is_check_due()) {
    begin_check(lock);
    return true;
  }
  if (do_search_work(lock)) return true;
  return lock.owns_lock() && do_mode_work(lock);
}

/// Takes the lock, may leave without it. Called by the session's task: what the problem says is
/// what the newest result is of.
void BodySession::Impl::begin_check(std::unique_lock<std::mutex>& lock) {
  const auto result = newest_;
  check_.claim(*result);
  lock.unlock();
  CheckRequest request = problem_->check_request();
  request.result = result;
  request.start_of_fit = result->start_of_fit;
  request.scene = scene_;
  lock.lock();
  check_.begin(lock, result, std::move(request), shared_from_this());
}

MotionCheck BodySession::Impl::check(const CheckRequest& request, const JobContext& job) {
  if (!checker_ || checker_->model() != request.model || checker_->scene() != request.scene)
    checker_ = std::make_unique<MotionChecker>(request.scene, request.model);
  return checker_->check(request, job);
}

/// Publishes a result again with the findings of its check.
void BodySession::Impl::amend(const MotionFound& found) {
  auto result = std::make_shared<BodyResult>(*found.result);
  result->check = Check::kDone;
  if (found.finding) result->motion_check = std::make_shared<const MotionCheck>(*found.finding);
  add_sentence(result->report.message,
               found.finding
                   ? describe_motion(*found.finding)
                   : fmt::format("The motion's error could not be determined: {}", found.failure));
  publish(std::move(result));
}

}  // namespace limber::session
