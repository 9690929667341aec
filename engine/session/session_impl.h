#pragma once

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/session/answer_book.h"
#include "engine/session/document.h"
#include "engine/session/live_problem.h"
#include "engine/session/motion_check.h"
#include "engine/session/serial_task.h"
#include "engine/session/session.h"

namespace limber::session {

/// Two halves: what any thread may touch, under mutex_, never for longer than it takes to copy a
/// few values; and what only the task touches (problem_), without a lock, since at most one task
/// exists at a time.
class Session::Impl : public std::enable_shared_from_this<Session::Impl> {
 public:
  Impl(std::string id, scene::Scene scene, SessionOptions options,
       std::shared_ptr<ModelCache> cache, Executor executor, std::shared_ptr<Listener> listener);

  void open();
  EditReceipt edit(const std::vector<Edit>& edits, std::optional<Revision> expected);
  void solve_cold(std::uint64_t request);
  void cancel();
  using Farewell = SerialTask::Farewell;
  void shut(Farewell farewell);

  [[nodiscard]] scene::Scene scene() const;
  [[nodiscard]] Eigen::MatrixXd positions(const Result& result, int first_frame,
                                          int frame_count) const;
  template <class Read>
  [[nodiscard]] auto read(const Read& get) const {
    const std::lock_guard lock(mutex_);
    return get(*this);
  }

 private:
  friend class Session;
  using Clock = std::chrono::steady_clock;
  /// Between improved iterates of one solve.
  static constexpr std::chrono::milliseconds kPublishInterval{8};

  /// What the build leaves behind for readers.
  struct Built {
    std::shared_ptr<const reduced::ReducedModel> model;
    Geometry geometry;
    std::vector<int> compact_of_source;
    std::string message;   // of the model's report, and what it has otherwise than asked for
    std::string accuracy;  // of results, where the model misses its tolerance
    double seconds = 0;
    bool from_cache = false;
  };

  /// What the task takes out of the shared half for one round of work.
  struct Round {
    enum class Start { kWarm, kCold };
    enum class Depth { kSolve, kCorrectOnly };
    Revision revision = 0;
    std::uint64_t content = 0;  // Document::content()
    Clock::time_point edited_at;
    EditBatch batch;
    bool is_whole = false;
    Start start = Start::kWarm;
    std::uint64_t cold_request = 0;  // the newest contained, of this round or an earlier one
    [[nodiscard]] double since_edit_ms() const {
      return std::chrono::duration<double, std::milli>(Clock::now() - edited_at).count();
    }
    Depth depth = Depth::kSolve;
    Cancellation cancellation;
  };

  /// What the check of a result ends with: what was found out, or why it was not.
  struct Amendment {
    std::shared_ptr<const Result> result;
    std::shared_ptr<const MotionCheck> check;
    std::string failure;
  };

  // session_impl.cpp: the shared half.
  void post(std::unique_lock<std::mutex> lock);
  void demand_usable() const;
  void say_closed();

  // session_task.cpp: the task.
  void run();
  bool build();
  Built build_model(const JobContext& job);
  void build_failed(const Error& error);
  std::optional<Round> next_round();
  void work(const Round& round);
  void bring_up_to_date(const Round& round);
  void solve(const Round& round);
  /// What `round` asks for, to the end, its material included. @returns nothing where an edit made
  /// it out of date
  std::optional<spacetime::SolveReport> solve_whole(const Round& round);
  /// solver().solve(), published on the way. @returns nothing where an edit made it out of date
  /// @param ceiling  motions of a higher total energy are not published
  std::optional<spacetime::SolveReport> solve_motion(
      const Round& round, double ceiling = std::numeric_limits<double>::infinity());
  [[nodiscard]] bool stay_with_answer(const Round& round, const spacetime::SolveReport& ended);

  // session_material.cpp: the task's part of it that fits materials.
  /// On from the answer of the solver, which gets the material and the motion that were found where
  /// these are better. Nothing above the energy of the start is published.
  /// @returns nothing where an edit made it out of date
  std::optional<spacetime::MaterialReport> optimise_material(const Round& round);
  /// optimise_material() and the motion for what it has found; the start, converged before, where
  /// that is better after all. @returns as above
  std::optional<spacetime::SolveReport> fit_material(const Round& round,
                                                     const spacetime::SolveReport& start);
  void publish_material(const Round& round, const spacetime::MaterialReport& report,
                        const spacetime::MaterialSolver& solver);
  /// Coordinates and energies of result.modal and result.report with this material.
  void fill_material(const spacetime::Material& material, Result& result) const;

  std::shared_ptr<const Result> publish(const Round& round, const spacetime::SolveReport& report,
                                        bool final);
  void publish_failure(const Round& round, const std::string& reason);
  void hand_out(std::shared_ptr<Result> result, const Round& round);
  void hand_out(std::shared_ptr<Result> result);
  void tell_progress(const std::string& stage, double fraction);

  // session_check.cpp: the check of final results, its task and its place in the session's.
  [[nodiscard]] bool is_check_due() const;
  void begin_check(std::unique_lock<std::mutex> lock);
  void stop_check();  // called with the lock
  void run_check();
  std::optional<Amendment> check(const CheckRequest& request, const Cancellation& cancellation);
  void amend(const Amendment& amendment);

  const std::string id_;
  const SessionOptions options_;
  const std::shared_ptr<ModelCache> cache_;
  const std::shared_ptr<Listener> listener_;

  /// Held by the edit under way, before mutex_: the document changes under both, so that either is
  /// enough to read it and many edits hold up no reader.
  std::mutex edits_;
  mutable std::mutex mutex_;
  Document document_;
  SerialTask task_, check_task_;
  Touched touched_;              // since the task last looked
  Clock::time_point edited_at_;  // when the newest revision was accepted
  bool work_ = false;            // something to solve
  bool whole_ = true;            // the solver must be made anew from the whole document
  bool cold_ = false;            // solve_cold() was called
  std::uint64_t cold_asked_ = 0, cold_taken_ = 0;  // requests of solve_cold(): given, begun
  bool skip_solve_ = false;  // cancel() was called: bring up to date, but do not solve
  State state_ = State::kBuilding;
  std::string message_;
  Progress progress_;
  Cancellation cancellation_;  // of the build or round under way
  std::uint64_t sequence_ = 0;
  std::shared_ptr<const Result> newest_, converged_;
  std::shared_ptr<const Built> built_;
  std::uint64_t check_begun_for_ = 0;  // sequence of the result whose check was begun; 0: none
  Cancellation check_cancellation_;    // of that check
  std::optional<CheckRequest> check_request_;  // begun, and not taken by its task yet
  std::optional<Amendment> amendment_;         // of the newest result, not published yet
  std::atomic<bool> interrupt_{false};         // the running solve is out of date

  std::unique_ptr<LiveProblem> problem_;  // the task's
  AnswerBook answers_;                    // the task's
  bool solved_ = false;  // the task's: the motion has converged for the material it has
  /// The task's: q of the motion with forces alone that the fit of the material began with.
  std::shared_ptr<const Eigen::MatrixXf> start_of_fit_;
  int material_iterations_ = 0;      // the task's: in what is published next
  Clock::time_point progress_told_;  // the task's

  std::unique_ptr<MotionChecker> checker_;  // the check's task's
};

}  // namespace limber::session
