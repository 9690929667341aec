#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/job.h"
#include "engine/session/core/listener.h"
#include "engine/session/core/result_header.h"
#include "engine/session/core/serial_task.h"
#include "engine/session/core/values.h"

namespace limber::session {

/// The common part of sessions of every kind: the lock, the task, revisions and rounds,
/// interruption by newer edits, cancellation, publication, and the end. A kind brings a document
/// and a solver.
///
/// It has two halves. One is shared by all threads under mutex_, which is never held for longer
/// than it takes to copy a few values. The other belongs to the task alone, without a lock, since
/// at most one task exists at a time.
///
/// The session's task: build() once, then rounds as long as there is something to solve, then
/// do_other_work() as long as that finds any.
///
/// @tparam Result  derives from ResultHeader
/// @tparam Order   what a round solves: values, no longer tied to the document
template <class Result, class Order>
class SessionCore : public std::enable_shared_from_this<SessionCore<Result, Order>> {
 public:
  using Clock = std::chrono::steady_clock;
  using CloseNotification = SerialTask::CloseNotification;
  using SharedResult = std::shared_ptr<const Result>;

  /// One solve: what the task takes out of the shared half.
  struct Round {
    Revision revision = 0;
    Clock::time_point edited_at;  // when that revision was accepted
    Order order;
    Cancellation cancellation = {};
    /// cancel() was called after the newest edit: that is not solved any more, and `cancellation`
    /// is requested from the beginning.
    bool is_cancelled = false;
    bool is_rest = false;  // what solve() left to solve_rest()

    [[nodiscard]] double since_edit_ms() const {
      return std::chrono::duration<double, std::milli>(Clock::now() - edited_at).count();
    }
  };

  virtual ~SessionCore() = default;
  SessionCore(const SessionCore&) = delete;
  SessionCore& operator=(const SessionCore&) = delete;

  [[nodiscard]] const std::string& id() const { return id_; }

  /// Starts the build. @throws Error{kInternal} where the executor takes nothing
  void open() {
    std::unique_lock lock(mutex_);
    has_work_ = true;
    post(std::move(lock));
    lock = std::unique_lock(mutex_);
    if (state_ == State::kBuilding && !task_.is_pending() && !message_.empty())
      throw Error(ErrorCode::kInternal, "", message_);
  }

  /// Stops the build or the running round, and what waits for one.
  void cancel() {
    std::unique_lock lock(mutex_);
    if (!task_.is_pending() || cancel_other_work()) return;
    if (state_ == State::kBuilding) building_.request();
    is_cancelled_ = true;
    first_.clear();
    round_.request();
    note_cancel();
    if (rest_) post(std::move(lock));  // nothing long any more
  }

  void shut(CloseNotification notification) {
    std::unique_lock lock(mutex_);
    state_ = State::kClosed;
    building_.request();
    round_.request();
    note_close();
    // A listener must not block: another task of the session ends by itself then.
    const auto wait = task_.is_current() ? SerialTask::Wait::kNone : SerialTask::Wait::kUntilIdle;
    task_.close(std::move(lock), notification);
    close_other_tasks(wait);
  }

  template <class Read>
  [[nodiscard]] auto read(const Read& get) const {
    const std::lock_guard lock(mutex_);
    return get();
  }

  [[nodiscard]] State state() const {
    return read([this] { return state_; });
  }
  [[nodiscard]] std::string message() const {
    return read([this] { return message_; });
  }
  [[nodiscard]] Progress progress() const {
    return read([this] { return progress_; });
  }
  [[nodiscard]] SharedResult newest_result() const {
    return read([this] { return newest_; });
  }
  [[nodiscard]] SharedResult final_result() const {
    return read([this] { return final_; });
  }

 protected:
  /// Between iterates of one solve that are published.
  static constexpr std::chrono::milliseconds kPublishInterval{8};

  SessionCore(std::string id, Executor executor, std::shared_ptr<Listener<Result>> listener)
      : id_(std::move(id)),
        listener_(std::move(listener)),
        task_(mutex_, std::move(executor), [this] { report_closed(); }),
        edited_at_(Clock::now()),
        sequence_(listener_ ? listener_->first_sequence() : 0) {}

  // What a kind implements.

  /// The task's: makes the solver. @returns its remarks. An exception fails the build.
  virtual std::string build(const JobContext& job) = 0;
  /// With the lock: what the document says now. Rounds after this one see later edits only.
  virtual Order take_order() = 0;
  /// The task's: solves and publishes. Its exceptions are passed to solve_failed().
  virtual void solve(const Round& round) = 0;
  /// The task's: puts the solver right after solve() or solve_rest() threw, and publishes a failed
  /// result.
  virtual void solve_failed(const Round& round, const std::string& reason) = 0;

  // What a kind may add.

  /// The task's: what solve() left with leave_rest().
  virtual void solve_rest(const Round& /*round*/) {}
  /// With the lock: whether edits leave the round alone; it is solved to its end first.
  virtual bool must_finish(const Order& /*order*/) const { return false; }
  /// With the lock, called by edits: the running round is out of date.
  virtual void interrupt_round() { round_.request(); }
  /// The task's, with the lock, when nothing is to be solved: takes over the lock and does one
  /// thing without it. @returns false, with the lock held, if there is nothing to do
  virtual bool do_other_work(std::unique_lock<std::mutex>& /*lock*/) { return false; }
  /// With the lock: of what do_other_work() would do, where that is long.
  [[nodiscard]] virtual std::optional<Urgency> urgency_of_other_work() const { return {}; }
  /// With the lock. @returns whether cancel() was for other work
  virtual bool cancel_other_work() { return false; }
  /// With the lock: cancel() is for rounds.
  virtual void note_cancel() {}
  /// With the lock: a round that was taken is lost, as memory ran out.
  virtual void note_lost_round() {}
  /// With the lock: the session closes.
  virtual void note_close() {}
  virtual void close_other_tasks(SerialTask::Wait /*wait*/) {}
  /// With the lock: edits are refused. @throws Error{kFailedPrecondition}
  virtual void demand_editable() const { demand_model(); }

  // What a kind calls.

  /// With the lock. @throws Error{kFailedPrecondition}
  void demand_open() const {
    if (task_.is_closed()) throw Error(ErrorCode::kFailedPrecondition, "", "the session is closed");
  }
  void demand_model() const {
    demand_open();
    if (state_ == State::kFailed) {
      throw Error(ErrorCode::kFailedPrecondition, "",
                  fmt::format("the session has no model: {}", message_));
    }
  }

  /// One edit: `prepare` without the lock, in parallel to readers and the task; `commit` with it.
  /// @returns what `commit` returns
  template <class Prepare, class Commit>
  EditReceipt change(const Prepare& prepare, const Commit& commit) {
    const std::lock_guard one_at_a_time(edits_);
    read([this] { demand_editable(); });
    prepare();
    std::unique_lock lock(mutex_);
    demand_editable();
    EditReceipt receipt = commit();
    note_change(std::move(lock));
    return receipt;
  }
  /// The document has changed: takes the lock, and sees to it that it is solved.
  void note_change(std::unique_lock<std::mutex> lock) {
    mark_changed();
    request_round(std::move(lock));
  }
  /// There is something to solve: takes the lock, and interrupts the running round.
  void request_round(std::unique_lock<std::mutex> lock) {
    has_work_ = true;
    is_cancelled_ = false;
    if (!is_finishing_) interrupt_round();
    post(std::move(lock));
  }
  /// The same with the lock and for the task itself, which will come to it.
  void mark_changed() {
    edited_at_ = Clock::now();
    has_work_ = true;
    is_cancelled_ = false;
  }
  /// @throws Error{kFailedPrecondition} behind the first edit
  void demand_unedited() const {
    if (document_revision() == 0) return;
    throw Error(ErrorCode::kFailedPrecondition, "", "edits were made already");
  }
  /// With the lock. @throws Error{kFailedPrecondition} where no final result is as new as that
  void demand_answer_of(Revision revision) const {
    if (revision == 0 || (final_ && final_->revision >= revision)) return;
    throw Error(ErrorCode::kFailedPrecondition, "",
                fmt::format("revision {} is not solved yet", revision));
  }
  /// With the lock: what there was before an edit is solved to its end before the edit.
  void finish_first(Revision revision, Order order) {
    const Revision taken = first_.empty() ? taken_ : first_.back().revision;
    if ((task_.is_running() || rest_) && taken == revision && !has_work_) {
      is_finishing_ = true;  // it is just being solved
    } else if (taken != revision || has_work_) {
      first_.push_back({revision, edited_at_, std::move(order)});
    }
  }

  /// Sees to it that the task runs. Takes the lock, leaves without it.
  void post(std::unique_lock<std::mutex> lock) {
    const Urgency urgency = next_urgency().value_or(Urgency::kPrompt);
    task_.post(
        std::move(lock), [self = this->shared_from_this()] { self->run(); }, message_, urgency);
  }
  /// With the lock: another try at a build that failed.
  void build_again() {
    state_ = State::kBuilding;
    message_.clear();
    progress_ = {};
    building_ = {};
  }

  /// The task's: from here on edits interrupt the round, even one that must_finish().
  void allow_interruption() {
    const std::lock_guard lock(mutex_);
    if (std::exchange(is_finishing_, false) && has_work_) interrupt_round();
  }
  /// The task's, the last step of solve(): a first answer is published, and solve_rest() finishes
  /// the round, unless an edit comes first. Sessions that share few cores show all their first
  /// answers before they refine any.
  void leave_rest(const Round& round) {
    const std::lock_guard lock(mutex_);
    rest_ = round;
    rest_->is_rest = true;
  }
  /// The task's: whether a round was cancelled for a newer edit, whose solve continues from the
  /// last iterate.
  [[nodiscard]] bool is_out_of_date() const {
    return read([this] { return task_.is_closed() || (has_work_ && !is_finishing_); });
  }
  /// The task's: a result of the round.
  void publish(std::shared_ptr<Result> result, const Round& round) {
    result->revision = round.revision;
    result->since_edit_ms = round.since_edit_ms();
    publish(std::move(result));
  }
  /// @param is_needed  with the lock: whether it is published at all
  template <class IsNeeded>
  void publish_if(std::shared_ptr<Result> result, const IsNeeded& is_needed) {
    SharedResult older, older_final;  // freed without the lock: they may be large
    {
      const std::lock_guard lock(mutex_);
      if (task_.is_closed() || !is_needed()) return;
      set_newest(result, older, older_final);
    }
    notify(listener_.get(), [&](Listener<Result>& listener) { listener.on_result(result); });
  }
  void publish(std::shared_ptr<Result> result) {
    publish_if(std::move(result), [] { return true; });
  }
  /// With the lock: numbers the result. @param older, older_final  those before, for the caller to
  /// free without it
  void set_newest(const std::shared_ptr<Result>& result, SharedResult& older,
                  SharedResult& older_final) {
    result->sequence = ++sequence_;
    older = std::exchange(newest_, result);
    if (result->is_final) older_final = std::exchange(final_, result);
  }
  /// The task's: the next iterate comes at once.
  void publish_next_iterate() { published_at_ = {}; }
  /// The task's: iterates come at most once in kPublishInterval.
  [[nodiscard]] bool is_time_to_publish() {
    const auto now = Clock::now();
    if (now - published_at_ < kPublishInterval) return false;
    published_at_ = now;
    return true;
  }

  /// The task's, within build().
  void report_progress(const std::string& stage, double fraction) {
    const auto now = Clock::now();
    const Progress progress{stage, std::clamp(fraction, 0.0, 1.0)};
    {
      const std::lock_guard lock(mutex_);
      const bool is_same_stage = progress_.stage == stage;
      progress_ = progress;
      const bool is_end = progress.fraction == 1;  // of a stage: always reported
      if (is_same_stage && !is_end && now - progress_reported_at_ < kProgressInterval) return;
    }
    progress_reported_at_ = now;
    notify(listener_.get(), [&](Listener<Result>& listener) { listener.on_progress(progress); });
  }

  const std::string id_;
  const std::shared_ptr<Listener<Result>> listener_;

  /// Held by the running edit, before mutex_: the document changes under both, so that either is
  /// enough to read it and many edits hold up no reader.
  std::mutex edits_;
  mutable std::mutex mutex_;
  SerialTask task_;
  State state_ = State::kBuilding;
  std::string message_;
  Progress progress_;
  Clock::time_point edited_at_;  // when the newest revision was accepted
  bool has_work_ = false;        // something to solve
  std::uint64_t sequence_ = 0;
  SharedResult newest_, final_;
  Cancellation building_, round_;  // of the running build and round
  bool is_finishing_ = false;      // edits do not interrupt the running round

 private:
  static constexpr std::chrono::milliseconds kProgressInterval{20};  // between reports of a stage

  /// With the lock, the urgency of the next work: a build and the first solve of an opened session
  /// are less urgent than edits. Nothing where there is nothing long to do.
  [[nodiscard]] std::optional<Urgency> next_urgency() const {
    if (state_ != State::kReady) return Urgency::kPatient;
    const bool is_edited = document_revision() > 0;
    if (has_work_) return is_edited ? Urgency::kPrompt : Urgency::kPatient;
    if (rest_ && is_cancelled_) return Urgency::kPrompt;
    if (rest_) return is_edited ? Urgency::kRefining : Urgency::kPatient;
    return urgency_of_other_work();
  }
  /// With the lock: the next work has another urgency than the task that runs.
  [[nodiscard]] bool is_for_another_task() const {
    const auto urgency = next_urgency();
    return !task_.is_closed() && urgency && task_.would_change(*urgency);
  }

  void report_closed() {
    notify(listener_.get(),
           [](Listener<Result>& listener) { listener.on_state(State::kClosed, ""); });
  }

  void run() {
    if (!task_.begin()) return;
    try {
      if (!is_built_ && !try_to_build()) return;
      while (const std::optional<Round> round = next_round()) work(*round);
    } catch (...) {  // out of memory between rounds: accepted edits wait for the next call
      std::unique_lock lock(mutex_);
      has_work_ = true;
      note_lost_round();
      task_.finish(std::move(lock));
    }
  }

  bool try_to_build() {
    std::string message;
    try {
      const JobContext job{
          read([this] { return building_; }),
          [this](const std::string& stage, double fraction) { report_progress(stage, fraction); }};
      message = build(job);
      is_built_ = true;
      set_state(State::kReady, message);
      return true;
    } catch (const Error& error) {
      message =
          error.field().empty() ? error.what() : fmt::format("{}: {}", error.field(), error.what());
    } catch (const std::exception& error) {
      message = error.what();
    } catch (...) {
      message = "unknown exception";
    }
    set_state(State::kFailed, message);
    std::unique_lock lock(mutex_);
    const bool again = state_ == State::kBuilding && !task_.is_closed();  // requested meanwhile
    task_.finish(std::move(lock));
    if (again) post(std::unique_lock(mutex_));
    return false;
  }

  void set_state(State state, const std::string& message) {
    {
      const std::lock_guard lock(mutex_);
      if (task_.is_closed()) return;
      state_ = state;
      message_ = message;
    }
    notify(listener_.get(), [&](Listener<Result>& listener) { listener.on_state(state, message); });
  }

  /// Nothing to do: the task ends, in the same breath.
  std::optional<Round> next_round() {
    std::unique_lock lock(mutex_);
    while (!task_.is_closed() && !has_work_ && !rest_ && !is_for_another_task() &&
           do_other_work(lock)) {
      if (!lock.owns_lock()) lock = std::unique_lock(mutex_);
    }
    if (is_for_another_task()) {
      const Urgency urgency = *next_urgency();
      task_.repost(
          std::move(lock), [self = this->shared_from_this()] { self->run(); }, message_, urgency);
      return std::nullopt;
    }
    // An edit that did not come too late for it lets the rest go.
    std::optional<Round> rest = std::exchange(rest_, std::nullopt);
    if (rest && !task_.is_closed() && (is_finishing_ || !has_work_)) return rest;
    if (task_.is_closed() || !has_work_) {
      is_cancelled_ = false;
      task_.finish(std::move(lock));
      return std::nullopt;
    }
    round_ = Cancellation();
    std::optional<Round> round;
    if (first_.empty()) {
      has_work_ = false;
      round.emplace(Round{document_revision(), edited_at_, take_order()});
      round->is_cancelled = std::exchange(is_cancelled_, false);
      is_finishing_ = must_finish(round->order);
    } else {
      round = std::move(first_.front());
      first_.pop_front();
      is_finishing_ = true;
    }
    if (round->is_cancelled) round_.request();
    round->cancellation = round_;
    taken_ = round->revision;
    return round;
  }

  void work(const Round& round) {
    published_at_ = Clock::now();
    std::string reason;
    try {
      return round.is_rest ? solve_rest(round) : solve(round);
    } catch (const std::exception& error) {
      reason = error.what();
    } catch (...) {
      reason = "unknown exception";
    }
    solve_failed(round, reason);
  }

  /// With the lock.
  [[nodiscard]] virtual Revision document_revision() const = 0;

  bool is_built_ = false;      // the task's
  std::optional<Round> rest_;  // of the round that was taken last
  bool is_cancelled_ = false;  // no edit since cancel()
  std::deque<Round> first_;    // to be solved before what the document says, in any case
  Revision taken_ = 0;         // of the running round, or the last
  Clock::time_point published_at_, progress_reported_at_;  // the task's
};

}  // namespace limber::session
