#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "engine/session/linkage/design_desk.h"
#include "engine/session/linkage/ended_designs.h"
#include "engine/session/linkage/linkage_session.h"
#include "engine/session/linkage/live_design.h"
#include "engine/session/linkage/live_linkage.h"
#include "engine/session/serial_task.h"

namespace limber::session {

/// Two halves, as Session::Impl has them: what any thread may touch, under mutex_; and live_, which
/// only the task touches, of which there is at most one at a time.
class LinkageSession::Impl : public std::enable_shared_from_this<LinkageSession::Impl> {
 public:
  Impl(std::string id, scene::Linkage linkage, LinkageLimits limits, Executor executor,
       std::shared_ptr<LinkageListener> listener);

  void open();
  EditReceipt edit(const std::vector<LinkageEdit>& edits, std::optional<Revision> expected);
  void cancel();
  void shut(SerialTask::Farewell farewell);

  void start_design(DesignRequest request, std::uint64_t tag);
  void change_design(const DesignChange& change);
  EditReceipt take_design(std::optional<Revision> expected);
  /// `call` on the desk, with the lock; a task that the executor dropped is posted again.
  template <class Call>
  void steer_design(const Call& call) {
    std::unique_lock lock(mutex_);
    call(desk_);
    post(std::move(lock));
  }

  template <class Read>
  [[nodiscard]] auto read(const Read& get) const {
    const std::lock_guard lock(mutex_);
    return get(*this);
  }

 private:
  friend class LinkageSession;
  using Clock = std::chrono::steady_clock;
  using Conditions = std::shared_ptr<const scene::LinkageConditions>;
  static constexpr std::chrono::milliseconds kPublishInterval{8};

  /// An equilibrium that a design has found for conditions.
  struct Lesson {
    Conditions conditions;
    std::shared_ptr<const DesignCandidate> candidate;
  };
  struct Round {
    Revision revision = 0;
    Conditions conditions;
    Clock::time_point edited_at;
    Cancellation cancellation;
    std::vector<Lesson> lessons;
    std::vector<Conditions> origins = {};  // see LiveLinkage::solve
    [[nodiscard]] double since_edit_ms() const {
      return std::chrono::duration<double, std::milli>(Clock::now() - edited_at).count();
    }
  };
  /// One design, as the task runs it.
  struct DesignRound {
    DesignDesk::Order order;
    Revision revision = 0;
    Conditions conditions;
  };
  using Work = std::variant<std::monostate, Round, DesignRound>;

  static LinkageDocument opened(const scene::Linkage& linkage, LinkageLimits limits);
  static bool holds_where_it_is(const std::vector<LinkageEdit>& edits);

  // With the lock:
  void demand_open() const;
  void post(std::unique_lock<std::mutex> lock);
  void finish_first(Round round);
  EditReceipt apply_design(std::optional<Revision> expected);
  void stop_design();

  // The task's, linkage_session_task.cpp:
  void run();
  bool build();
  [[nodiscard]] LinkageGeometry describe() const;
  [[nodiscard]] Work next_work();
  [[nodiscard]] Round next_round();
  void solve(const Round& round);
  void publish_iterate(const Round& round);
  [[nodiscard]] Eigen::VectorXf shape_now() const;
  void hand_out(std::shared_ptr<LinkageResult> result, const Round& round);
  void say_closed();

  // linkage_session_design.cpp:
  void run_design(const DesignRound& round);
  void search(const DesignRound& round, DesignInfo& info);
  bool between_steps(LiveDesign& design, DesignInfo& info, const DesignRound& round);
  void end_search(LiveDesign& design, DesignInfo& info, const DesignRound& round,
                  const rods::DesignReport& report);
  void find_erection(const LiveDesign& design, const DesignRound& round, DesignInfo& info);
  void tell_design(const LiveDesign* design, const DesignInfo& info, const DesignRound& round);
  [[nodiscard]] std::shared_ptr<LinkageResult> shape_from_before() const;
  bool end_design(DesignInfo& info);

  const std::string id_;
  const scene::Linkage linkage_;
  const std::shared_ptr<LinkageListener> listener_;

  /// Held by the edit under way, before mutex_: the document changes under both, so that either is
  /// enough to read it and many edits hold up no reader.
  std::mutex edits_;
  mutable std::mutex mutex_;
  LinkageDocument document_;
  SerialTask task_;
  DesignDesk desk_;
  Clock::time_point edited_at_;
  bool work_ = false, cancelled_ = false;
  std::deque<Round> first_;   // to be solved before what the document says, whatever comes
  Revision taken_ = 0;        // of the round under way, or the last
  bool must_finish_ = false;  // edits do not interrupt it
  State state_ = State::kBuilding;
  std::string message_;
  const Cancellation building_;
  Cancellation round_;  // of the solve under way
  std::uint64_t sequence_ = 0;
  std::shared_ptr<const LinkageResult> newest_, final_;
  std::shared_ptr<const LinkageGeometry> geometry_;
  std::shared_ptr<const LinkageShape> shape_;
  std::vector<Lesson> lessons_;  // that the task has not learned yet
  Conditions designed_;          // that the newest design was made under

  std::unique_ptr<LiveLinkage> live_;  // the task's
  Clock::time_point published_at_;     // the task's
  EndedDesigns ended_;                 // the task's
};

}  // namespace limber::session
