#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/session.h"
#include "server/service/frame_streams.h"
#include "server/service/hub.h"
#include "server/service/result_waiters.h"

namespace limber::server {

/// What the service knows of one session besides the session: who waits, who watches, which jobs
/// are its.
///
/// Lock order: no lock of this class is held while the session is called.
class SessionRecord final : public session::Listener,
                            public std::enable_shared_from_this<SessionRecord> {
 public:
  /// What the open request said, for answers that need no session.
  struct Opened {
    std::string id, name;
    proto::MeshSource mesh_source;  // where it is short enough to be told again (path, sample)
    int nodes = 0, tets = 0, frames = 0;
    double length_unit = 1;
    int lanes = 0;            // modes the scene asks for
    int keyframe_rows = 0;    // of the solver, at most
    std::uint64_t bytes = 0;  // estimated memory without constraints and keyframes
  };
  /// The job of the building is told how it goes; the record is the session's listener.
  SessionRecord(Hub& hub, Opened opened, JobId open_job);

  /// Right after the session is made. Before, answers come from `Opened` alone.
  void attach(std::shared_ptr<session::Session> session);
  /// The session, for calls. @throws Error{kNotFound} once it is detached
  [[nodiscard]] std::shared_ptr<session::Session> session() const;
  std::shared_ptr<session::Session> detach();
  /// The build failed or was cancelled, and nobody has asked for another.
  [[nodiscard]] bool failed() const;
  /// Ends the session; no task of it runs any more. @throws Error{kNotFound} once it is detached
  void close();

  [[nodiscard]] const Opened& opened() const { return opened_; }
  [[nodiscard]] proto::SessionStatus status() const;
  [[nodiscard]] ResultWaiters& waiters() { return waiters_; }
  /// An edit went through: how many constraints there are now.
  void constraints_changed(std::size_t count);
  [[nodiscard]] std::size_t constraint_count() const;
  /// @throws Refusal LIMIT_EXCEEDED if so many constraints and keyframes would take the session
  /// beyond its memory
  void demand_memory(std::size_t constraints, std::size_t keyframes) const;

  /// The final result that contains `solve_cold(job)` ends this job.
  void expect_cold(JobId job);
  /// Of CancelRequest: stops the session's work; who waits is told.
  void cancel();
  void welcome(const std::string& prefix);
  /// To the subscribers of the status topic, if there are any.
  void publish_status();
  /// The result that an export is made of, kept so that all its parts agree.
  /// @param sequence  of an export begun before, 0 for the newest of those; @throws
  /// Error{kFailedPrecondition}
  [[nodiscard]] std::shared_ptr<const session::Result> exported(std::uint64_t sequence) const;
  void begin_export(std::shared_ptr<const session::Result> result);
  /// Everything that is open ends; who waits gets `fault`.
  void end(const std::exception& fault);

  void on_progress(const session::Progress& progress) override;
  void on_state(session::State state, const std::string& message) override;
  void on_result(const std::shared_ptr<const session::Result>& result) override;

 private:
  void adopt_model(const session::Session& session);
  [[nodiscard]] std::vector<JobId> take_jobs();
  [[nodiscard]] std::vector<JobId> take_jobs_ended_by(const session::Result& result);
  [[nodiscard]] std::optional<JobId> take_job(std::optional<JobId>& job);

  Hub& hub_;
  const Opened opened_;
  const std::string status_topic_;
  ResultWaiters waiters_;
  std::shared_ptr<FrameStreams> streams_;

  mutable std::mutex mutex_;  // of what follows
  std::shared_ptr<session::Session> session_;
  std::shared_ptr<const session::Result> newest_;
  session::State state_ = session::State::kBuilding;
  std::string message_;
  session::Progress progress_;
  std::size_t constraints_ = 0;
  bool build_cancelled_ = false;
  std::deque<std::shared_ptr<const session::Result>> exports_;  // newest last
  std::optional<proto::ModelInfo> model_;
  std::optional<JobId> open_job_, cold_job_;
};

}  // namespace limber::server
