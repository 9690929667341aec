#include "server/service/session_record.h"

#include <fmt/format.h>

#include <utility>

#include "limber/v1/stream.pb.h"
#include "server/codec/errors.h"
#include "server/codec/result.h"
#include "server/log/log.h"
#include "server/service/memory_estimate.h"

namespace limber::server {

SessionRecord::SessionRecord(Hub& hub, Opened opened, JobId open_job)
    : hub_(hub),
      opened_(std::move(opened)),
      status_topic_(fmt::format("session/{}/status", opened_.id)),
      waiters_(hub.control, opened_.length_unit),
      streams_(std::make_shared<FrameStreams>(hub, opened_.id, opened_.length_unit)),
      open_job_(open_job) {}

void SessionRecord::attach(std::shared_ptr<session::Session> session) {
  const std::size_t constraints = session->constraints().size();
  bool ready = false;
  {
    const std::lock_guard lock(mutex_);
    session_ = session;
    constraints_ = constraints;
    ready = state_ == session::State::kReady;
  }
  if (ready)
    adopt_model(*session);  // it was quicker than this call: on_state() found no session to ask
}

void SessionRecord::adopt_model(const session::Session& session) {
  auto info = encode_model(session);
  streams_->geometry(session.geometry());  // first: results that come from now on find it
  std::shared_ptr<const session::Result> newest;
  {
    const std::lock_guard lock(mutex_);
    model_ = std::move(info);
    newest = newest_;
  }
  if (newest) streams_->note(newest);
}

std::shared_ptr<session::Session> SessionRecord::session() const {
  const std::lock_guard lock(mutex_);
  if (!session_)
    throw Error(ErrorCode::kNotFound, "session", fmt::format("session '{}' is closed", opened_.id));
  return session_;
}

std::shared_ptr<session::Session> SessionRecord::detach() {
  const std::lock_guard lock(mutex_);
  return std::exchange(session_, nullptr);
}

bool SessionRecord::failed() const {
  const std::lock_guard lock(mutex_);
  return session_ && state_ == session::State::kFailed;
}

void SessionRecord::close() {
  session()->close();
  end(Error(ErrorCode::kFailedPrecondition, "session",
            fmt::format("session '{}' was closed", opened_.id)));
  detach();
}

proto::SessionStatus SessionRecord::status() const {
  proto::SessionStatus status;
  status.set_session(opened_.id);
  status.set_name(opened_.name);
  status.set_nodes(static_cast<std::uint32_t>(opened_.nodes));
  status.set_tets(static_cast<std::uint32_t>(opened_.tets));
  status.set_frames(static_cast<std::uint32_t>(opened_.frames));
  std::shared_ptr<session::Session> session;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
    status.set_state(encode_state(state_));
    status.set_message(message_);
    status.set_constraints(static_cast<std::uint32_t>(constraints_));
    if (newest_) *status.mutable_result() = encode_result(*newest_, opened_.length_unit);
    if (model_) *status.mutable_model() = *model_;
    if (state_ == session::State::kBuilding)
      *status.mutable_progress() = encode_progress(progress_);
  }
  if (session) status.set_revision(session->revision());
  return status;
}

void SessionRecord::constraints_changed(std::size_t count) {
  const std::lock_guard lock(mutex_);
  constraints_ = count;
}

void SessionRecord::demand_memory(std::size_t constraints, std::size_t keyframes) const {
  const std::uint64_t limit = hub_.options.limits.session_bytes;
  const std::uint64_t bytes =
      opened_.bytes + estimate_constraint_bytes(constraints, opened_.lanes) +
      estimate_keyframe_bytes(keyframes, opened_.keyframe_rows, constraints, opened_.lanes) +
      estimate_pose_bytes(keyframes, opened_.nodes);
  if (bytes > limit) {
    throw limit_exceeded(
        "edits",
        fmt::format("estimated bytes of the session with {} constraints{}", constraints,
                    keyframes > 0 ? fmt::format(" and {} keyframes", keyframes) : ""),
        limit, bytes);
  }
}

std::size_t SessionRecord::constraint_count() const {
  const std::lock_guard lock(mutex_);
  return constraints_;
}

/// The jobs, in the same breath as noting what ends them: one that begins right after, when a
/// client has the answer, is not ended by it. Called with the lock.
std::vector<JobId> SessionRecord::take_jobs() {
  std::vector<JobId> jobs;
  for (auto* job : {&open_job_, &cold_job_}) {
    if (*job) jobs.push_back(**job);
    job->reset();
  }
  return jobs;
}

/// Any final result ends the opening. A cold job waits for one that has its own solve in it: a warm
/// one may become final between the wish and its beginning. Called with the lock.
std::vector<JobId> SessionRecord::take_jobs_ended_by(const session::Result& result) {
  std::vector<JobId> jobs;
  if (!result.converged) return jobs;
  if (open_job_) jobs.push_back(*std::exchange(open_job_, std::nullopt));
  if (cold_job_ && result.cold_request >= *cold_job_)
    jobs.push_back(*std::exchange(cold_job_, std::nullopt));
  return jobs;
}

std::optional<JobId> SessionRecord::take_job(std::optional<JobId>& job) {
  const std::lock_guard lock(mutex_);
  return std::exchange(job, std::nullopt);
}

void SessionRecord::expect_cold(JobId job) {
  std::optional<JobId> earlier;
  {
    const std::lock_guard lock(mutex_);
    earlier = std::exchange(cold_job_, job);
    if (state_ == session::State::kFailed) {  // a second try at the model
      state_ = session::State::kBuilding;
      message_.clear();
    }
  }
  waiters_.accept();
  if (earlier) hub_.jobs.cancelled(*earlier);  // started over
}

void SessionRecord::cancel() {
  const auto session = this->session();
  waiters_.refuse_all(Error(ErrorCode::kCancelled, "", "the session's work was cancelled"),
                      ResultWaiters::Later::kAccept);
  if (const auto job = take_job(cold_job_)) hub_.jobs.cancelled(*job);
  bool building = false;
  {
    const std::lock_guard lock(mutex_);
    building = build_cancelled_ = state_ == session::State::kBuilding;
  }
  if (!building) {  // a build says itself how it ended
    if (const auto job = take_job(open_job_)) hub_.jobs.cancelled(*job);
  }
  session->cancel();
}

void SessionRecord::welcome(const std::string& prefix) {
  streams_->welcome(prefix);
  if (status_topic_.compare(0, prefix.size(), prefix) == 0) publish_status();
}

void SessionRecord::begin_export(std::shared_ptr<const session::Result> result) {
  constexpr std::size_t kExportsAtOnce = 4;
  const std::lock_guard lock(mutex_);
  std::erase(exports_, result);
  exports_.push_back(std::move(result));
  if (exports_.size() > kExportsAtOnce) exports_.pop_front();
}

std::shared_ptr<const session::Result> SessionRecord::exported(std::uint64_t sequence) const {
  const std::lock_guard lock(mutex_);
  for (auto it = exports_.rbegin(); it != exports_.rend(); ++it) {
    if (sequence == 0 || (*it)->sequence == sequence) return *it;
  }
  throw Error(ErrorCode::kFailedPrecondition, "result_sequence", "begin the export with part 0");
}

void SessionRecord::end(const std::exception& fault) {
  streams_->close();
  waiters_.refuse_all(fault, ResultWaiters::Later::kRefuse);
  std::vector<JobId> ended;
  {
    const std::lock_guard lock(mutex_);
    ended = take_jobs();
  }
  for (const JobId job : ended) hub_.jobs.cancelled(job);
}

void SessionRecord::on_progress(const session::Progress& progress) {
  std::optional<JobId> job;
  {
    const std::lock_guard lock(mutex_);
    progress_ = progress;
    job = open_job_ ? open_job_ : cold_job_;
  }
  if (job) hub_.jobs.progress(*job, progress);
  publish_status();
}

void SessionRecord::on_state(session::State state, const std::string& message) {
  std::shared_ptr<session::Session> session;
  std::vector<JobId> ended;
  bool cancelled = false;
  {
    const std::lock_guard lock(mutex_);
    if (state == session::State::kFailed) ended = take_jobs();
    state_ = state;
    message_ = message;
    session = session_;
    cancelled = std::exchange(build_cancelled_, false);
  }
  log::info("session {} {}{}{}", opened_.id, proto::SessionState_Name(encode_state(state)),
            message.empty() ? "" : ": ", message);
  if (state == session::State::kFailed) {
    const Error fault(ErrorCode::kFailedPrecondition, "",
                      fmt::format("the session has no model: {}", message));
    waiters_.refuse_all(fault, ResultWaiters::Later::kRefuse);
    proto::Error error = error_to_proto(Error(ErrorCode::kNumerical, "", message));
    for (const JobId job : ended) {
      cancelled ? hub_.jobs.cancelled(job) : hub_.jobs.failed(job, error);
    }
  }
  if (state == session::State::kReady && session) adopt_model(*session);
  publish_status();
}

void SessionRecord::on_result(const std::shared_ptr<const session::Result>& result) {
  std::vector<JobId> ended;
  {
    const std::lock_guard lock(mutex_);
    newest_ = result;
    ended = take_jobs_ended_by(*result);
  }
  streams_->note(result);
  waiters_.note(result);
  for (const JobId job : ended) hub_.jobs.done(job);
  publish_status();
}

void SessionRecord::publish_status() {
  if (!hub_.transport.wanted(status_topic_)) return;
  proto::StreamMessage message;
  message.set_version(1);
  message.set_session(opened_.id);
  *message.mutable_status() = status();
  hub_.transport.publish(status_topic_, {message.SerializeAsString()});
}

}  // namespace limber::server
