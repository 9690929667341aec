#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/core/values.h"
#include "server/runtime/job_motion.h"
#include "server/runtime/run.h"
#include "server/runtime/ticket.h"
#include "server/runtime/timers.h"
#include "server/wire/errors.h"

namespace limber::server {

using JobId = std::uint64_t;

/// The products of a job besides its state.
struct JobProduct {
  proto::MeshArrays mesh;
  std::shared_ptr<const JobMotion> motion;
  std::optional<proto::SimulationReport> simulation;
  std::optional<proto::RecoveryReport> recovery;
  std::optional<proto::TetrahedralizationReport> tetrahedralization;
  std::vector<proto::Issue> issues;
  std::optional<proto::BeamSolution> beams;
  std::optional<proto::DiscretisationError> discretisation_error;
  std::vector<proto::ExportedFile> files;
};

/// Long work: its kind, its progress and its end. The newest finished ones are kept; the meshes and
/// motions of fewer. Thread-safe. Every change is reported to the listener of the registry (the
/// stream), in order: after the end of a job it is not reported as running.
class JobRegistry {
 public:
  /// Called with the registry's lock, which is what keeps the order: it must not call back.
  using OnChange = std::function<void(const proto::JobStatus&)>;
  using Cancel = std::function<void()>;

  /// @param first_id  ids are greater
  JobRegistry(boost::asio::io_context& control, std::uint32_t limit, OnChange on_change,
              std::uint64_t first_id = 0)
      : control_(control), limit_(limit), on_change_(std::move(on_change)), ids_(first_id) {}

  /// @param cancel  what to do when somebody asks the job to stop; called without locks
  /// @throws Refusal LIMIT_EXCEEDED when as many are running as may
  /// @param limit  kNone: of openings, which memory bounds
  enum class Limit { kOfRunning, kNone };
  JobId start(const std::string& kind, const std::string& session, Cancel cancel,
              Limit limit = Limit::kOfRunning);
  void progress(JobId job, const session::Progress& progress);
  /// The first end counts; of a job that was asked to stop, failure means cancelled.
  void done(JobId job, JobProduct product = {});
  void failed(JobId job, const proto::Error& error);
  void cancelled(JobId job);
  /// @throws Refusal NOT_FOUND; a finished job does not change
  void cancel(JobId job);

  /// @throws Refusal NOT_FOUND; RESTARTED for a job of another run, as all calls with a job
  [[nodiscard]] proto::JobStatus status(JobId job) const;
  [[nodiscard]] std::vector<proto::JobStatus> list() const;
  [[nodiscard]] std::uint32_t running() const;
  /// From now on; jobs that run go on.
  void set_limit(std::uint32_t limit);
  /// Publishes every running job once more, for a listener that has just come.
  void publish_running() const;
  /// @throws Refusal NOT_FOUND; FAILED_PRECONDITION where it runs, made no motion, or is too old
  [[nodiscard]] std::shared_ptr<const JobMotion> motion(JobId job) const;
  /// Answers at once, or when the job has ended, or after `seconds` with the state then.
  void get(JobId job, double seconds, const SharedTicket& ticket);
  /// The client has disconnected: its requests need no answers.
  void abandon(const std::string& client);
  /// Asks every running job to stop and answers all waiting clients.
  /// @param why  they wait in vain
  void shut_down(const Refusal& why);

 private:
  using Clock = std::chrono::steady_clock;
  struct Waiter {
    SharedTicket ticket;
    Deadline deadline;
  };
  struct Job {
    proto::JobStatus status;
    Clock::time_point started, reported;
    Cancel cancel;
    bool stop_requested = false, is_limited = true;
    JobProduct product;
    std::vector<Waiter> waiters;
    [[nodiscard]] bool running() const { return status.state() == proto::JOB_STATE_RUNNING; }
  };

  void end(JobId job, proto::JobState state, const proto::Error* error, JobProduct product);
  void late(JobId job, const SharedTicket& ticket);
  [[nodiscard]] const Job& find(JobId job) const;
  [[nodiscard]] static proto::JobStatus status_of(const Job& job);
  [[nodiscard]] static proto::Reply reply_of(const Job& job);
  void forget_oldest();

  boost::asio::io_context& control_;
  std::uint32_t limit_;
  OnChange on_change_;
  mutable std::mutex mutex_;
  std::map<JobId, Job> jobs_;
  std::deque<JobId> finished_;  // oldest first
  std::deque<JobId> motions_;   // of these, those with a retained motion
  RunIds ids_;
  std::uint32_t running_ = 0;  // of those that are limited
};

}  // namespace limber::server
