#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/core/step_notes.h"
#include "engine/session/core/values.h"
#include "limber/v1/stored.pb.h"
#include "server/runtime/attendance.h"
#include "server/runtime/frame_streams.h"
#include "server/runtime/frame_transfers.h"
#include "server/runtime/hub.h"
#include "server/runtime/result_waiters.h"
#include "server/runtime/session_memory.h"
#include "server/runtime/solve_times.h"
#include "server/runtime/stored_edits.h"
#include "server/runtime/timers.h"

namespace limber::server {

/// By the system's clock.
[[nodiscard]] std::uint64_t milliseconds_since_1970();

/// Topic of the status of a session of this name.
[[nodiscard]] std::string status_topic(const std::string& session);

/// The error for calls of a session that was parked during the call: they are made again.
class ParkedMeanwhile : public Error {
 public:
  using Error::Error;
};

/// The service's data about one session besides the session, for every kind: its waiting clients,
/// its viewers, its jobs.
///
/// Lock order: no lock of this class is held while the session is called.
class Record : public std::enable_shared_from_this<Record> {
 public:
  using Clock = std::chrono::steady_clock;

  /// The job of the building gets its progress.
  Record(Hub& hub, SessionKey key, std::string name, JobId open_job);
  virtual ~Record() = default;
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  [[nodiscard]] const std::string& id() const { return key_.name; }
  [[nodiscard]] const SessionKey& key() const { return key_; }
  /// Kind::name() of its kind.
  [[nodiscard]] virtual const char* kind() const = 0;
  /// For messages: what a session of this kind is of.
  [[nodiscard]] virtual const char* subject() const = 0;
  /// Whether an edit of any kind is done soon: its validation is short. Any thread, without
  /// waiting.
  [[nodiscard]] virtual bool edits_are_light() const { return true; }
  /// The build failed or was cancelled, and no other was requested.
  [[nodiscard]] bool failed() const;
  [[nodiscard]] proto::SessionStatus status() const;
  /// Its use of resources, for administrators.
  [[nodiscard]] proto::SessionUse use() const;
  [[nodiscard]] ResultWaiters& waiters() { return waiters_; }
  /// Part of the status: after a change of it, the caller publishes that.
  [[nodiscard]] Attendance& attendance() { return *attendance_; }
  [[nodiscard]] const std::shared_ptr<Attendance>& shared_attendance() const { return attendance_; }
  /// For a session that was parked and comes back: restores its clients. Before it is in the
  /// registry.
  void continue_with(std::shared_ptr<Attendance> people) { attendance_ = std::move(people); }

  /// Frames of the newest result, or of the newest final one.
  /// @throws Error{kNotFound} once it is closed; {kFailedPrecondition} before there are any
  [[nodiscard]] virtual std::shared_ptr<const FrameSource> frames(bool final_only) const = 0;
  [[nodiscard]] FrameTransfers& frame_transfers() { return frame_transfers_; }
  /// Geometry for the basis of a result that is fetched in parts; nothing without a transfer.
  [[nodiscard]] std::optional<proto::GetGeometryResponse> geometry_in_transfer(
      const proto::GetGeometryRequest& request) const;
  /// @throws as frames()
  [[nodiscard]] virtual proto::GetGeometryResponse geometry(
      const proto::GetGeometryRequest& request) const = 0;

  /// @throws Refusal or Error naming fields of the request
  /// @param author  the author of the edits: undo is of one's own
  [[nodiscard]] virtual proto::EditResponse edit(const proto::EditRequest& request,
                                                 const session::Author& author) = 0;
  /// The scene as edited, as much of it as the request wants.
  virtual void add_scene(const proto::GetSessionRequest& request,
                         proto::GetSessionResponse& response) const = 0;
  /// @throws Refusal naming `format` for one that this kind has not, OUT_OF_RANGE naming `part`
  [[nodiscard]] virtual proto::ExportResponse export_part(const proto::ExportRequest& request) = 0;
  /// Requests about a session that this kind alone has (such as solve_cold, start_design).
  /// @returns false where it has no such request
  [[nodiscard]] virtual bool answer(const proto::Request&, proto::Reply&) { return false; }
  /// The refusal of such a request by the other kinds.
  /// @param what  that they have not, for the message
  [[nodiscard]] Error lacks(const char* what) const;

  // For the store. These members define its data about the session.
  /// Author of a revision: Request.client, the client's public name, and the author of its edits.
  struct Maker {
    std::string client, name;
    session::Author author;
  };
  /// Held while an edit is made and given to the store: in there the edits have no gaps.
  [[nodiscard]] std::recursive_mutex& edit_order() { return edit_order_; }
  /// The edits that a request has just made, by values alone: values taken from the current answer
  /// are written out. Nothing where it made none. With edit_order().
  [[nodiscard]] virtual std::optional<proto::EditRequest> made_edits(
      const proto::Request& request) const;
  /// The changes to store for a revision, after those that the session has made by itself before
  /// it. Nothing where that is stored. With edit_order().
  [[nodiscard]] std::vector<store::Change> changes_of(std::uint64_t revision,
                                                      const proto::EditRequest& made,
                                                      const Maker& by);
  /// For a session that comes back: the stored revision. With edit_order().
  void note_stored(std::uint64_t revision) { stored_revision_ = revision; }
  /// Writes a checkpoint that replaces all edits up to its revision. May take long; any thread.
  /// @throws Error where that could not be read again
  using CheckpointWriter = std::function<void(proto::StoredCheckpoint&)>;
  /// Null where this kind has none: all its edits stay stored. With edit_order().
  /// @throws Error{kFailedPrecondition} where there is none now
  [[nodiscard]] virtual CheckpointWriter checkpoint() const { return nullptr; }
  /// Restores the result of its edits: called before all others.
  /// @throws Refusal or Error where it is none of such a session
  virtual void begin_at(const proto::StoredCheckpoint& checkpoint);
  /// Stored edits that no checkpoint replaces. With edit_order().
  [[nodiscard]] StoredEdits& stored_edits() { return stored_edits_; }
  /// Puts the newest final answer into a scene as where that begins, see Kind::begin_in().
  /// @returns whether there is one
  [[nodiscard]] virtual bool add_start(proto::Scene& /*scene*/) const { return false; }
  /// If it continues an earlier session, so does its numbering. Before it is attached.
  void continue_after(std::uint64_t sequence) { last_sequence_ = sequence; }

  // For the memory of all sessions.
  void set_memory(const SessionMemory& memory) { memory_ = memory; }
  [[nodiscard]] virtual std::uint64_t memory_bytes() const;
  /// Somebody asks for it.
  void touch() { touched_.store(Clock::now().time_since_epoch().count()); }
  /// Time of the last request to it.
  [[nodiscard]] Clock::time_point used_at() const {
    return Clock::time_point(Clock::duration(touched_.load()));
  }
  /// Its newest revision is solved, no one waits and nothing is under way that would be lost. With
  /// edit_order().
  [[nodiscard]] bool may_be_parked() const;
  /// Gives the newest final answer to the store. @returns whether there is one
  [[nodiscard]] bool keep_answer_now();
  /// The session itself was given to the store: answers, which come behind it, may follow.
  void begin_to_store_answers();
  /// It is parked: closes the session without a word to its clients. Later calls of this record get
  /// ParkedMeanwhile.
  void leave_to_store();

  /// It comes back from the store: requests for its answer can wait until that is available.
  /// @param stored  header of its stored answer: the published one until then
  void expect_answer(const proto::ResultInfo& stored) {
    is_returning_ = true;
    returning_result_ = stored;
  }
  /// The same, until the session starts; empty where it is no session that comes back.
  [[nodiscard]] const proto::ResultInfo& expected_answer() const { return returning_result_; }
  /// @param then  called on the pool when its answer is there, or will not be
  /// @returns false where there is nothing to wait for
  [[nodiscard]] bool wait_for_return(std::function<void()> then);

  /// For CancelRequest: stops the session's work; waiting clients are notified.
  void cancel();
  void welcome(const std::string& prefix, Has has);
  /// To the subscribers of the status topic, if there are any.
  void publish_status();
  /// Ends the session; no task of it runs any more. @throws Error{kNotFound} once it is closed
  void close();
  /// All open requests end; waiting clients get `fault`.
  void end(const std::exception& fault);

  /// For the session alone. @throws Error{kNotFound} once it is closed
  virtual void stop_work() = 0;
  /// Closes the session and lets it go; waiting clients are not notified. @throws Error{kNotFound}
  virtual void close_session() = 0;

 protected:
  [[noreturn]] void refuse_closed() const;
  /// @throws Error for a checkpoint of another kind of session
  void demand_document(bool is_of_this_kind) const;
  /// The status fields of a session of this kind. Called without the lock.
  virtual void describe(proto::SessionStatus& status) const = 0;
  /// The session and its model are there: streams may begin. Called without the lock.
  virtual void adopt_model() = 0;
  [[nodiscard]] virtual bool is_attached() const = 0;  // called with the lock
  /// Somebody subscribed to a prefix: topics that sessions of this kind alone have.
  virtual void welcome_more(const std::string&) {}
  /// Nothing that only this session knows would be lost. Called without the lock.
  [[nodiscard]] virtual bool is_at_rest() const { return true; }
  /// The newest result is final: jobs that it ends besides the opening. Called with the lock.
  virtual void take_ended_jobs(std::vector<JobId>&) {}

  /// The edits, by values alone, of a revision that the session has made by itself; without edits
  /// where that is not known.
  [[nodiscard]] virtual proto::EditRequest own_edits(std::uint64_t /*revision*/) const {
    return {};
  }
  /// The session has made a revision by itself: it is stored.
  void note_own_edits(std::uint64_t revision);
  void note_progress(const session::Progress& progress);
  void note_state(session::State state, const std::string& message);
  /// @param keep  called with the lock: keeps the result, and says what of it is streamed, if any
  /// @param check  whether an amendment of this result, if it is final, will follow
  void note_result(const std::shared_ptr<const proto::ResultInfo>& info,
                   const std::function<std::shared_ptr<const FrameSource>()>& keep,
                   ResultWaiters::Check check = ResultWaiters::Check::kDone);

  Hub& hub_;
  ResultWaiters waiters_;
  std::shared_ptr<Attendance> attendance_ = std::make_shared<Attendance>(Attendance::Clock::now());
  const std::shared_ptr<FrameStreams> streams_;
  mutable std::mutex mutex_;         // of what follows, and of what subclasses have
  std::uint64_t last_sequence_ = 0;  // of a session before this one
  session::State state_ = session::State::kBuilding;
  std::string message_;
  /// For work that was requested after the opening.
  std::optional<JobId> later_job_;

 private:
  void note_returned();
  /// A final result, for waiting clients: they get it after its answer is stored.
  struct Unstored {
    std::shared_ptr<const proto::ResultInfo> result;
    ResultWaiters::Check check = ResultWaiters::Check::kPending;
  };
  [[nodiscard]] std::vector<Unstored> take_unstored();
  void notify_waiters(const std::vector<Unstored>& results);
  void keep_answer_later();
  bool give_answer(std::chrono::steady_clock::time_point now);  // with answering_
  [[nodiscard]] std::optional<store::KeptAnswer> newest_answer() const;
  void keep_answer();
  [[nodiscard]] std::vector<JobId> take_jobs();
  [[nodiscard]] std::optional<JobId> take_job(std::optional<JobId>& job);

  const SessionKey key_;
  const std::string name_, status_topic_;
  mutable FrameTransfers frame_transfers_;  // results in use are kept longer
  session::Progress progress_;
  std::shared_ptr<const proto::ResultInfo> newest_info_;
  std::vector<Unstored> unstored_;
  bool is_returning_ = false;
  proto::ResultInfo returning_result_;
  std::vector<std::function<void()>> for_return_;
  SolveTimes solve_times_;
  bool build_cancelled_ = false;
  std::optional<JobId> open_job_;
  // A design that is taken is reported within the request that takes it.
  SessionMemory memory_;  // before it is in the registry
  std::atomic<Clock::rep> touched_{Clock::now().time_since_epoch().count()};
  std::atomic<bool> is_parked_{false};
  std::recursive_mutex edit_order_;
  std::uint64_t stored_revision_ = 0;  // with edit_order_
  StoredEdits stored_edits_;           // the same
  std::mutex answering_;  // held while an answer is given to the store: the newest is the last
  std::atomic<bool> may_store_answers_{false}, is_answer_due_{false}, is_deferred_{false};
  // With answering_: no answer is stored before, and what waits for that.
  std::chrono::steady_clock::time_point next_answer_{};
  Deadline later_answer_;
};

}  // namespace limber::server
