#include "server/runtime/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>

#include <utility>

#include "server/log/log.h"
#include "server/runtime/stream_message.h"
#include "server/wire/errors.h"
#include "server/wire/session_values.h"

namespace limber::server {

std::string status_topic(const std::string& session) {
  return fmt::format("session/{}/status", session);
}

std::uint64_t milliseconds_since_1970() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(since).count());
}

Record::Record(Hub& hub, SessionKey key, std::string name, JobId open_job)
    : hub_(hub),
      waiters_(hub.control),
      streams_(std::make_shared<FrameStreams>(hub, key)),
      key_(std::move(key)),
      name_(std::move(name)),
      status_topic_(status_topic(id())),
      open_job_(open_job) {}

bool Record::failed() const {
  const std::lock_guard lock(mutex_);
  return is_attached() && state_ == session::State::kFailed;
}

void Record::refuse_closed() const {
  if (is_parked_.load())
    throw ParkedMeanwhile(ErrorCode::kNotFound, "session",
                          fmt::format("session '{}' is parked", id()));
  throw Error(ErrorCode::kNotFound, "session", fmt::format("session '{}' is closed", id()));
}

std::uint64_t Record::memory_bytes() const {
  const std::uint64_t in_transfer = frame_transfers_.bytes();
  const std::lock_guard lock(mutex_);
  return (state_ == session::State::kBuilding ? memory_.building : memory_.kept) + in_transfer;
}

std::optional<proto::GetGeometryResponse> Record::geometry_in_transfer(
    const proto::GetGeometryRequest& request) const {
  const auto result =
      frame_transfers_.find_basis(request.basis_hash(), FrameTransfers::Clock::now());
  if (!result) return std::nullopt;
  return result->geometry(request.known_basis_hash());
}

bool Record::may_be_parked() const {
  if (waiters_.size() > 0) return false;
  {
    const std::lock_guard lock(mutex_);
    if (!is_attached() || state_ != session::State::kReady || open_job_ || later_job_) return false;
    if (!newest_info_ || !newest_info_->converged()) return false;
  }
  proto::SessionStatus now;
  describe(now);
  if (stored_revision_ != now.revision() || !is_at_rest()) return false;
  const std::lock_guard lock(mutex_);
  return newest_info_->revision() == now.revision();
}

bool Record::keep_answer_now() {
  const std::lock_guard lock(answering_);
  return give_answer(std::chrono::steady_clock::now());
}

bool Record::wait_for_return(std::function<void()> then) {
  const std::lock_guard lock(mutex_);
  if (is_returning_) for_return_.push_back(std::move(then));
  return is_returning_;
}

void Record::note_returned() {
  std::vector<std::function<void()>> waiting;
  {
    const std::lock_guard lock(mutex_);
    is_returning_ = false;
    waiting.swap(for_return_);
  }
  for (auto& then : waiting) boost::asio::post(hub_.request_pool, std::move(then));
}

void Record::leave_to_store() {
  is_parked_.store(true);
  try {
    close_session();
  } catch (const std::exception&) {  // a client was quicker
  }
  end(ParkedMeanwhile(ErrorCode::kNotFound, "session",
                      fmt::format("session '{}' is parked", id())));
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
  status.set_is_stored(hub_.store != nullptr);
  status.set_memory_bytes(memory_bytes());
  {
    const std::lock_guard lock(mutex_);
    status.set_state(encode_state(state_));
    const bool is_stopped = state_ == session::State::kClosed && hub_.stopping.load();
    status.set_server_stopped(is_stopped);
    if (is_stopped) status.set_next_run_follows(hub_.next_run() == NextRun::kTakesOver);
    status.set_message(message_);
    if (newest_info_) {
      *status.mutable_result() = *newest_info_;
    } else if (is_returning_ && returning_result_.sequence() > 0) {
      *status.mutable_result() = returning_result_;
    }
    if (state_ == session::State::kBuilding)
      *status.mutable_progress() = encode_progress(progress_);
  }
  attendance_->describe(status, Attendance::Clock::now());
  describe(status);
  return status;
}

proto::SessionUse Record::use() const {
  proto::SessionUse use = use_of(status());
  const std::lock_guard lock(mutex_);
  solve_times_.describe(use);
  return use;
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
    if (!is_attached()) refuse_closed();
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

void Record::welcome(const std::string& prefix, Has has) {
  streams_->welcome(prefix, has);
  if (status_topic_.compare(0, prefix.size(), prefix) == 0) publish_status();
  welcome_more(prefix);
}

void Record::end(const std::exception& fault) {
  streams_->close();
  note_returned();
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
  if (is_parked_.load()) return;
  log::info(log::Fields{{"session", id()},
                        {"error", state == session::State::kFailed ? message : std::string()}},
            "session {} {}{}{}", id(), proto::SessionState_Name(encode_state(state)),
            message.empty() ? "" : ": ", message);
  if (state == session::State::kFailed) {
    const Error fault(ErrorCode::kFailedPrecondition, "",
                      fmt::format("the session has no model: {}", message));
    waiters_.refuse_all(fault, ResultWaiters::Later::kRefuse);
    note_returned();
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
  const bool is_for_store = hub_.store && info->converged() && !info->first_picture();
  {
    const std::lock_guard lock(mutex_);
    newest_info_ = info;
    if (is_for_store) unstored_.push_back({info, check});
    solve_times_.note(*info);
    frames = keep();
    if (info->converged()) {
      if (open_job_) ended.push_back(*std::exchange(open_job_, std::nullopt));
      take_ended_jobs(ended);
    }
  }
  if (frames) streams_->note(frames);
  using Storing = ResultWaiters::Storing;
  if (!info->first_picture())
    waiters_.note(info, check, is_for_store ? Storing::kPending : Storing::kDone);
  for (const JobId job : ended) hub_.jobs.done(job);
  if (info->converged()) note_returned();
  publish_status();
  if (is_for_store) keep_answer_later();
}

std::vector<Record::Unstored> Record::take_unstored() {
  const std::lock_guard lock(mutex_);
  return std::exchange(unstored_, {});
}

void Record::notify_waiters(const std::vector<Unstored>& results) {
  for (const Unstored& one : results) waiters_.note(one.result, one.check);
}

std::optional<proto::EditRequest> Record::made_edits(const proto::Request& request) const {
  if (!request.has_edit()) return std::nullopt;
  return request.edit();
}

std::vector<store::Change> Record::changes_of(std::uint64_t revision,
                                              const proto::EditRequest& made, const Maker& by) {
  std::vector<store::Change> changes;
  const auto add = [&](std::uint64_t number, const proto::EditRequest& edits, const Maker& maker) {
    if (edits.edits_size() == 0) {  // a gap is named when the session comes back
      log::error(log::Fields{{"session", id()}},
                 "revision {} of session {} cannot be stored: its edits are not known", number,
                 id());
      return;
    }
    proto::StoredEdit edit;
    edit.set_revision(number);
    *edit.mutable_edits() = edits.edits();
    edit.set_client(maker.client);
    edit.set_client_name(maker.name);
    edit.set_author(maker.author);
    edit.set_at_ms(milliseconds_since_1970());
    std::string bytes = edit.SerializeAsString();
    stored_edits_.note_edit(bytes.size());
    changes.emplace_back(store::EditedSession{key_.uid, number, std::move(bytes)});
  };
  while (stored_revision_ + 1 < revision) {
    ++stored_revision_;
    add(stored_revision_, own_edits(stored_revision_), {});
  }
  if (revision > stored_revision_) add(revision, made, by);
  stored_revision_ = std::max(stored_revision_, revision);
  return changes;
}

void Record::begin_at(const proto::StoredCheckpoint&) { demand_document(false); }

void Record::demand_document(bool is_of_this_kind) const {
  if (is_of_this_kind) return;
  throw Error(ErrorCode::kInvalidArgument, "checkpoint",
              fmt::format("this is no checkpoint of {}", subject()));
}

void Record::note_own_edits(std::uint64_t revision) {
  if (!hub_.store) return;
  const std::lock_guard order(edit_order_);
  if (stored_revision_ >= revision) return;
  hub_.store->append(changes_of(revision, own_edits(revision), {}), nullptr);
}

void Record::begin_to_store_answers() {
  if (!hub_.store) return;
  may_store_answers_.store(true);
  keep_answer_later();
}

/// By the threads that solve: those of requests may be encoding for seconds, and somebody waits.
void Record::keep_answer_later() {
  if (!may_store_answers_.load()) return;
  if (is_answer_due_.exchange(true)) {
    if (is_deferred_.load()) notify_waiters(take_unstored());
    return;
  }
  boost::asio::post(hub_.solve_pool, [self = shared_from_this()] { self->keep_answer(); });
}

/// Long answers at most once in kLargeInterval: writing them takes as long as they are. Nobody
/// waits for that.
void Record::keep_answer() {
  const std::lock_guard lock(answering_);
  const auto now = std::chrono::steady_clock::now();
  if (now < next_answer_) {
    const std::chrono::duration<double> wait = next_answer_ - now;
    later_answer_ = call_after(hub_.control, wait.count(), [self = weak_from_this()] {
      const auto record = self.lock();
      if (!record) return;
      boost::asio::post(record->hub_.solve_pool, [record] { record->keep_answer(); });
    });
    is_deferred_.store(true);
    return notify_waiters(take_unstored());
  }
  is_deferred_.store(false);
  is_answer_due_.store(false);
  (void)give_answer(now);
}

bool Record::give_answer(std::chrono::steady_clock::time_point now) {
  constexpr std::size_t kLarge = 4 << 20;
  constexpr std::chrono::seconds kLargeInterval{5};
  const std::vector<Unstored> results = take_unstored();
  auto answer = newest_answer();
  if (!answer) {
    notify_waiters(results);
    return false;
  }
  if (answer->answer.size() > kLarge) next_answer_ = now + kLargeInterval;
  // If it cannot be written, the edit requests report it: waiting would not help.
  hub_.store->keep_answer(key_.uid, std::move(*answer),
                          [self = weak_from_this(), results](const std::exception_ptr&) {
                            if (const auto record = self.lock()) record->notify_waiters(results);
                          });
  return true;
}

std::optional<store::KeptAnswer> Record::newest_answer() const {
  try {
    proto::StoredAnswer answer;
    {
      const std::lock_guard own(mutex_);
      if (!newest_info_ || state_ == session::State::kClosed) return std::nullopt;
      *answer.mutable_result() = *newest_info_;
    }
    answer.set_revision(answer.result().revision());
    answer.set_sequence(answer.result().sequence());
    if (!add_start(*answer.mutable_start())) return std::nullopt;
    return store::KeptAnswer{answer.SerializeAsString(), status().SerializeAsString()};
  } catch (const std::exception& fault) {  // closed meanwhile
    log::debug(log::Fields{{"session", id()}, {"error", fault.what()}},
               "the answer of session {} is not stored: {}", id(), fault.what());
    return std::nullopt;
  }
}

void Record::publish_status() {
  if (is_parked_.load()) return;  // clients know of the session itself, not of this record
  if (!hub_.transport.has_subscriber(status_topic_)) return;
  auto message = stream_message(hub_.run, id(), key_.uid);
  *message.mutable_status() = status();
  hub_.transport.publish(status_topic_, {message.SerializeAsString()});
}

}  // namespace limber::server
