#include "server/runtime/record.h"

#include <fmt/format.h>

#include <utility>

#include "server/log/log.h"
#include "server/runtime/stream_message.h"
#include "server/wire/errors.h"
#include "server/wire/session_values.h"

namespace limber::server {

Record::Record(Hub& hub, SessionKey key, std::string name, JobId open_job)
    : hub_(hub),
      waiters_(hub.control),
      streams_(std::make_shared<FrameStreams>(hub, key)),
      key_(std::move(key)),
      name_(std::move(name)),
      status_topic_(fmt::format("session/{}/status", id())),
      open_job_(open_job) {}

bool Record::failed() const {
  const std::lock_guard lock(mutex_);
  return is_attached() && state_ == session::State::kFailed;
}

Error Record::closed() const {
  return {ErrorCode::kNotFound, "session", fmt::format("session '{}' is closed", id())};
}

Error Record::lacks(const char* what) const {
  return {ErrorCode::kFailedPrecondition, "session",
          fmt::format("session '{}' is of {}: there is no {}", id(), subject(), what)};
}

void Record::close() {
  close_session();
  end(Error(ErrorCode::kFailedPrecondition, "session",
            fmt::format("session '{}' was closed", id())));
}

proto::SessionStatus Record::status() const {
  proto::SessionStatus status;
  status.set_session(id());
  status.set_name(name_);
  status.set_uid(key_.uid);
  status.set_kind(kind());
  {
    const std::lock_guard lock(mutex_);
    status.set_state(encode_state(state_));
    status.set_server_stopped(state_ == session::State::kClosed && hub_.stopping.load());
    status.set_message(message_);
    if (newest_info_) *status.mutable_result() = *newest_info_;
    if (state_ == session::State::kBuilding)
      *status.mutable_progress() = encode_progress(progress_);
  }
  attendance_.describe(status, Attendance::Clock::now());
  describe(status);
  return status;
}

/// The jobs, in the same breath as noting what ends them: one that begins right after, when a
/// client has the answer, is not ended by it. Called with the lock.
std::vector<JobId> Record::take_jobs() {
  std::vector<JobId> jobs;
  for (auto* job : {&open_job_, &later_job_}) {
    if (*job) jobs.push_back(**job);
    job->reset();
  }
  return jobs;
}

std::optional<JobId> Record::take_job(std::optional<JobId>& job) {
  const std::lock_guard lock(mutex_);
  return std::exchange(job, std::nullopt);
}

void Record::cancel() {
  {
    const std::lock_guard lock(mutex_);
    if (!is_attached()) throw closed();
  }
  waiters_.refuse_all(Error(ErrorCode::kCancelled, "", "the session's work was cancelled"),
                      ResultWaiters::Later::kAccept);
  if (const auto job = take_job(later_job_)) hub_.jobs.cancelled(*job);
  bool building = false;
  {
    const std::lock_guard lock(mutex_);
    building = build_cancelled_ = state_ == session::State::kBuilding;
  }
  if (!building) {  // a build says itself how it ended
    if (const auto job = take_job(open_job_)) hub_.jobs.cancelled(*job);
  }
  stop_work();
}

void Record::welcome(const std::string& prefix) {
  streams_->welcome(prefix);
  if (status_topic_.compare(0, prefix.size(), prefix) == 0) publish_status();
  welcome_more(prefix);
}

void Record::end(const std::exception& fault) {
  streams_->close();
  waiters_.refuse_all(fault, ResultWaiters::Later::kRefuse);
  std::vector<JobId> ended;
  {
    const std::lock_guard lock(mutex_);
    ended = take_jobs();
  }
  for (const JobId job : ended) hub_.jobs.cancelled(job);
}

void Record::note_progress(const session::Progress& progress) {
  std::optional<JobId> job;
  {
    const std::lock_guard lock(mutex_);
    progress_ = progress;
    job = open_job_ ? open_job_ : later_job_;
  }
  if (job) hub_.jobs.progress(*job, progress);
  publish_status();
}

void Record::note_state(session::State state, const std::string& message) {
  std::vector<JobId> ended;
  bool cancelled = false, attached = false;
  {
    const std::lock_guard lock(mutex_);
    if (state == session::State::kFailed) ended = take_jobs();
    state_ = state;
    message_ = message;
    attached = is_attached();
    cancelled = std::exchange(build_cancelled_, false);
  }
  log::info("session {} {}{}{}", id(), proto::SessionState_Name(encode_state(state)),
            message.empty() ? "" : ": ", message);
  if (state == session::State::kFailed) {
    const Error fault(ErrorCode::kFailedPrecondition, "",
                      fmt::format("the session has no model: {}", message));
    waiters_.refuse_all(fault, ResultWaiters::Later::kRefuse);
    const proto::Error error = error_to_proto(Error(ErrorCode::kNumerical, "", message));
    for (const JobId job : ended) {
      cancelled ? hub_.jobs.cancelled(job) : hub_.jobs.failed(job, error);
    }
  }
  if (state == session::State::kReady && attached) adopt_model();
  publish_status();
}

/// Any final result ends the opening.
void Record::note_result(const std::shared_ptr<const proto::ResultInfo>& info,
                         const std::function<std::shared_ptr<const FrameSource>()>& keep,
                         ResultWaiters::Check check) {
  std::vector<JobId> ended;
  std::shared_ptr<const FrameSource> frames;
  {
    const std::lock_guard lock(mutex_);
    newest_info_ = info;
    frames = keep();
    if (info->converged()) {
      if (open_job_) ended.push_back(*std::exchange(open_job_, std::nullopt));
      take_ended_jobs(ended);
    }
  }
  if (frames) streams_->note(frames);
  if (!info->first_picture()) waiters_.note(info, check);
  for (const JobId job : ended) hub_.jobs.done(job);
  publish_status();
}

void Record::publish_status() {
  if (!hub_.transport.has_subscriber(status_topic_)) return;
  auto message = stream_message(hub_.run, id(), key_.uid);
  *message.mutable_status() = status();
  hub_.transport.publish(status_topic_, {message.SerializeAsString()});
}

}  // namespace limber::server
