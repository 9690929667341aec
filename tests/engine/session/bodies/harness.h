#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "engine/session/bodies/session.h"
#include "tests/support/temporary_folder.h"

namespace limber::session::test {

/// Threads that run tasks; waits for them all at the end.
class Pool {
 public:
  explicit Pool(int threads);
  ~Pool();
  [[nodiscard]] Executor executor();

 private:
  void loop();
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> tasks_;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

/// Keeps what a session says; checks that calls do not overlap and sequences have no gap.
class Recorder : public BodyListener {
 public:
  void on_progress(const Progress& progress) override;
  void on_state(State state, const std::string& message) override;
  void on_result(const std::shared_ptr<const BodyResult>& result) override;

  /// Waits until a final result of at least this revision has come, null if none comes within a
  /// minute or so. Amendments do not count.
  std::shared_ptr<const BodyResult> wait_final(Revision revision, std::uint64_t after_sequence = 0);
  /// The same of one that has been checked.
  std::shared_ptr<const BodyResult> wait_checked(Revision revision,
                                                 std::uint64_t after_sequence = 0);
  /// What came first after this one and is no amendment, null if nothing did.
  [[nodiscard]] std::shared_ptr<const BodyResult> next_solved(std::uint64_t sequence) const;
  bool wait_state(State state);
  [[nodiscard]] std::vector<std::shared_ptr<const BodyResult>> results() const;
  [[nodiscard]] std::vector<State> states() const;
  [[nodiscard]] std::vector<Progress> progress() const;
  [[nodiscard]] std::string fault() const;  // empty if the session behaved

  /// Called first thing in every on_result, without a lock.
  std::function<void(const BodyResult&)> hook;
  std::function<void(const Progress&)> progress_hook;
  std::function<void(State)> state_hook;

 private:
  struct Turn;
  /// The newest result that is wanted, once there is one; before: the one published before it.
  std::shared_ptr<const BodyResult> wait_result(
      std::uint64_t after_sequence,
      const std::function<bool(const BodyResult&, const BodyResult* before)>& is_wanted);
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool inside_ = false;
  std::string fault_;
  std::vector<std::shared_ptr<const BodyResult>> results_;
  std::vector<State> states_;
  std::vector<Progress> progress_;
};

/// The final energy of a scene opened fresh, solved from rest.
std::shared_ptr<const BodyResult> solve_fresh(const scene::Scene& scene,
                                              const std::shared_ptr<ModelCache>& cache,
                                              const SessionOptions& options = {});

/// One model cache for a whole test program: the same bar is built once.
std::shared_ptr<ModelCache> shared_cache();

}  // namespace limber::session::test
