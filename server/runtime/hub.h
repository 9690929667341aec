#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <map>
#include <memory>

#include "engine/session/core/executor.h"
#include "server/runtime/job_registry.h"
#include "server/runtime/newest_first.h"
#include "server/runtime/open_requests.h"
#include "server/runtime/options.h"
#include "server/runtime/run.h"
#include "server/runtime/taking_turns.h"
#include "server/store/store.h"
#include "server/transport/transport.h"
#include "server/wire/errors.h"

namespace limber::server {

/// The addresses of this server for pages, and their tokens. Empty: it serves none.
struct WebEntrance {
  std::string url, token;              // the token of those that administer
  std::map<Role, std::string> tokens;  // of each role
};

/// The phase of the server's life.
enum class Phase {
  kStarting,
  kReady,
  kDraining,  // it will end: new sessions are refused, open requests get their answers
};

/// State shared by all parts of the service. Outlives all sessions.
struct Hub {
  explicit Hub(ServerOptions given);
  void publish_job(const proto::JobStatus& status);
  /// Runs tasks of one session: what somebody edits goes before all else, its first answer before
  /// the final ones of others.
  /// @param client  its opener: builds of clients take turns
  [[nodiscard]] session::Executor session_executor(const std::string& client);
  /// Of all sessions together [bytes].
  [[nodiscard]] std::uint64_t memory_limit() const;
  /// The calling thread, one of patient_request_pool, gives way to those of the usual pools.
  static void give_way();
  /// Of jobs, which --max-jobs bounds.
  void post_job(std::function<void()> task);
  /// The refusal of requests now, since the server ends.
  [[nodiscard]] Refusal going_down() const;
  /// The knowledge of the next run about requests to this one.
  [[nodiscard]] NextRun next_run() const;

  ServerOptions options;
  const Run run = Run::begin();
  RunIds session_ids{run.first_id};
  Counters counters;
  boost::asio::io_context control{1};  // timers and signals, one thread
  Transport transport;
  JobRegistry jobs;
  OpenRequests open_requests;
  std::atomic<Phase> phase{Phase::kStarting};
  std::atomic<bool> stopping{false};
  std::atomic<bool> is_handed_over{false};  // it ends for another run to take its place
  WebEntrance web;                          // set before the transport starts
  const std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  /// Null: sessions end with the server. The transport answers requests that wait for it.
  std::unique_ptr<store::Store> store;
  NewestFirst refining;
  /// Pause between a first answer and the rest of its round. The answer and the acknowledgement
  /// pass five threads on their way to the client. A scheduler may leave any of them behind a
  /// computing thread, however nice that is, until its next tick (4 ms at 250 Hz). The p99 of the
  /// first frames of a drag on two cores was 5 to 6 ms without this pause, 1.2 to 2.1 with it.
  static constexpr std::chrono::milliseconds kRefinementDelay{2};
  TakingTurns patient;  // on the threads of session_pool
  // Last, so that their threads end before anything they use does.
  boost::asio::thread_pool solve_pool;    // what somebody waits for
  boost::asio::thread_pool refine_pool;   // until it is final: at a somewhat lower priority
  boost::asio::thread_pool session_pool;  // builds, checks, designs and jobs: at a lower priority
  boost::asio::thread_pool request_pool;  // heavy requests, encoding of frames
  boost::asio::thread_pool patient_request_pool;  // exports and the like: as session_pool

 private:
  /// On a thread that yields to those of the other pools: builds leave a place to short tasks.
  void post_patiently(const std::string& client, std::function<void()> task,
                      TakingTurns::Share share);
  void schedule_refinement();
  void run_patiently();
};

/// Topic of all jobs.
inline constexpr const char* kJobsTopic = "jobs";

}  // namespace limber::server
