#include <fmt/format.h>

#include <utility>

#include "engine/session/bodies/impl.h"

// The check of final results: found out by a task of its own, once nothing is left to solve, and
// published by the session's task, so that results keep their order. A newer edit interrupts it.

namespace limber::session {

/// Called with the lock, by the session's task.
bool BodySession::Impl::is_check_due() const {
  return newest_ && newest_ == final_ && newest_->check == Check::kPending &&
         newest_->sequence != check_begun_for_ && problem_ && problem_->started();
}

bool BodySession::Impl::do_other_work(std::unique_lock<std::mutex>& lock) {
  if (amendment_) {
    const Amendment amendment = *std::exchange(amendment_, std::nullopt);
    const bool is_newest = amendment.result == newest_;
    lock.unlock();
    if (is_newest) amend(amendment);
    return true;
  }
  if (!is_check_due()) return false;
  begin_check(lock);
  return true;
}

/// Takes the lock, may leave without it. Called by the session's task: what the problem says is
/// what the newest result is of.
void BodySession::Impl::begin_check(std::unique_lock<std::mutex>& lock) {
  check_begun_for_ = newest_->sequence;
  check_cancellation_ = {};
  const auto result = newest_;
  lock.unlock();
  CheckRequest request = problem_->check_request();
  request.result = result;
  request.start_of_fit = result->start_of_fit;
  lock.lock();
  if (check_begun_for_ != result->sequence) return;  // an edit was quicker
  check_request_ = std::move(request);
  std::string refused;
  check_task_.post(
      std::move(lock), [self = shared_from_this(), this] { run_check(); }, refused);
  if (refused.empty()) return;
  lock = std::unique_lock(mutex_);
  if (check_begun_for_ != result->sequence) return;  // an edit came while the executor refused
  check_request_.reset();
  amendment_ = Amendment{result, {}, refused};
}

void BodySession::Impl::stop_check() {
  check_cancellation_.request();
  check_request_.reset();
  amendment_.reset();
  check_begun_for_ = 0;
}

void BodySession::Impl::run_check() {
  if (!check_task_.begin()) return;
  std::unique_lock lock(mutex_);
  while (check_request_ && !check_task_.is_closed()) {
    const CheckRequest request = std::move(*check_request_);
    check_request_.reset();
    const Cancellation cancellation = check_cancellation_;
    lock.unlock();
    std::optional<Amendment> amendment = check(request, cancellation);
    lock.lock();
    if (amendment && !cancellation.requested()) amendment_ = std::move(amendment);
  }
  const bool has_news = amendment_.has_value();
  check_task_.finish(std::move(lock));
  if (!has_news) return;
  post(std::unique_lock(mutex_));
}

/// @returns nothing where it was cancelled
std::optional<BodySession::Impl::Amendment> BodySession::Impl::check(
    const CheckRequest& request, const Cancellation& cancellation) {
  Amendment amendment{request.result, {}, {}};
  try {
    if (!checker_) {
      const auto model = read([this] { return built_->model; });
      checker_ = std::make_unique<MotionChecker>(document_.unedited(), model);
    }
    amendment.check =
        std::make_shared<const MotionCheck>(checker_->check(request, {cancellation, {}}));
    return amendment;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kCancelled) return std::nullopt;
    amendment.failure = error.what();
  } catch (const std::exception& error) {
    amendment.failure = error.what();
  } catch (...) {
    amendment.failure = "unknown exception";
  }
  return amendment;
}

/// Publishes a result again with what was found out about it.
void BodySession::Impl::amend(const Amendment& amendment) {
  auto result = std::make_shared<BodyResult>(*amendment.result);
  result->check = Check::kDone;
  result->motion_check = amendment.check;
  add_sentence(result->report.message,
               amendment.check ? describe_motion(*amendment.check)
                               : fmt::format("The motion's error could not be determined: {}",
                                             amendment.failure));
  publish(std::move(result));
}

void add_sentence(std::string& message, const std::string& sentence) {
  if (!message.empty() && !sentence.empty()) message += message.back() == '.' ? " " : ". ";
  message += sentence;
}

}  // namespace limber::session
