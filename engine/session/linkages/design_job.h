#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "engine/base/job.h"
#include "engine/session/linkages/design_values.h"

namespace limber::session {

/// The requests of clients for the design of a session, and its results. Its state belongs to the
/// owner's mutex: "with the lock" means that one. There is at most one running design.
class DesignJob {
 public:
  explicit DesignJob(std::mutex& mutex) : mutex_(mutex) {}

  struct Order {
    DesignRequest request;
    std::uint64_t tag = 0;
    Cancellation stop;
  };

  // With the lock, any thread:
  [[nodiscard]] bool is_active() const { return order_ || running_; }
  [[nodiscard]] bool is_running() const { return running_; }
  [[nodiscard]] bool is_waiting() const { return order_.has_value(); }
  /// Has a client ended the one that is running?
  [[nodiscard]] bool is_stopping() const { return is_active() && stop_.requested(); }
  /// @throws Error{kFailedPrecondition} while one is running
  void begin(DesignRequest request, std::uint64_t tag);
  /// If refused, the earlier change stays, even if the design has not read it yet.
  /// @param joints  3 x joints, where the linkage is [length]
  /// @throws Error{kFailedPrecondition} where none is running; as DesignGoal::validate and
  /// demand_near
  void change(const DesignChange& change, const Eigen::Matrix3Xd& joints);
  /// Takes effect when the running step is done. @throws as change
  void pause();
  void resume();
  /// @throws as change
  void stop();
  /// The same, whether there is one or not.
  void stop_any();
  [[nodiscard]] const std::shared_ptr<const DesignInfo>& info() const { return info_; }
  /// The best of the newest design; null before there is one.
  [[nodiscard]] const std::shared_ptr<const DesignCandidate>& best() const { return best_; }
  void note_taken(Revision revision);

  // With the lock, the session's task:
  [[nodiscard]] Order take_order();
  void note(std::shared_ptr<const DesignInfo> info, std::shared_ptr<const DesignCandidate> best);
  void end(DesignInfo info);
  [[nodiscard]] bool is_paused() const { return paused_ && !stop_.requested(); }
  /// Does a client want a pause or another goal that the task has not seen to?
  [[nodiscard]] bool is_steered() const { return is_paused() || (changed_ && !stop_.requested()); }
  [[nodiscard]] std::optional<DesignGoal> take_goal() { return std::exchange(changed_, {}); }
  /// Until there is something to do: a new goal, the end of the pause, or a stop.
  void wait(std::unique_lock<std::mutex>& lock);

 private:
  void demand_active() const;

  std::mutex& mutex_;
  std::condition_variable woken_;
  std::optional<Order> order_;  // not begun yet
  bool running_ = false, paused_ = false;
  Cancellation stop_;
  DesignGoal goal_;                    // the newest
  std::optional<DesignGoal> changed_;  // that the task has not seen
  std::shared_ptr<const DesignInfo> info_;
  std::shared_ptr<const DesignCandidate> best_;
};

}  // namespace limber::session
