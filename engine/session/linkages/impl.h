#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/core/background_check.h"
#include "engine/session/core/session_core.h"
#include "engine/session/linkages/condition_rules.h"
#include "engine/session/linkages/design_job.h"
#include "engine/session/linkages/ended_designs.h"
#include "engine/session/linkages/live_design.h"
#include "engine/session/linkages/live_problem.h"
#include "engine/session/linkages/refinement.h"
#include "engine/session/linkages/session.h"

namespace limber::session {

/// The order that the task of a session of a linkage works on.
struct LinkageOrder {
  using Conditions = std::shared_ptr<const scene::LinkageConditions>;
  /// An equilibrium that a design has found for conditions.
  struct DesignedEquilibrium {
    Conditions conditions;
    std::shared_ptr<const DesignCandidate> candidate;
  };

  Conditions conditions;
  std::vector<DesignedEquilibrium> designed;
  std::vector<Conditions> origins;  // see LiveLinkage::solve
};

class LinkageSession::Impl final : public SessionCore<LinkageResult, LinkageOrder> {
 public:
  Impl(std::string id, scene::Linkage linkage, LinkageLimits limits, Executor executor,
       std::shared_ptr<LinkageListener> listener, std::optional<RecalledAnswer> recalled);

  EditReceipt edit(const std::vector<LinkageEdit>& edits, std::optional<Revision> expected,
                   const Author& author);
  void begin_at(LinkageDocument::Checkpoint checkpoint);
  [[nodiscard]] LinkageDocument::Checkpoint checkpoint() const {  // with the lock
    // Numbers of edges mean those that it has by now, which the answer tells.
    demand_answer_of(has_named_edges_ ? std::max<Revision>(held_where_it_was_, 1)
                                      : held_where_it_was_);
    return document_.checkpoint();
  }

  void start_design(DesignRequest request, std::uint64_t tag);
  void change_design(const DesignChange& change);
  void stop_design();
  EditReceipt take_design(std::optional<Revision> expected);
  /// `call` on the design, with the lock; a task that the executor dropped is posted again.
  template <class Call>
  void steer_design(const Call& call) {
    std::unique_lock lock(mutex_);
    call(design_);
    post(std::move(lock));
  }

  // With the lock, see read():
  [[nodiscard]] const LinkageDocument& document() const { return document_; }
  [[nodiscard]] const DesignJob& design() const { return design_; }
  [[nodiscard]] const std::shared_ptr<const LinkageGeometry>& geometry() const { return geometry_; }
  [[nodiscard]] const std::shared_ptr<const LinkageShape>& shape() const { return shape_; }
  /// From the scene, or chosen while the session was built; 0: not yet.
  [[nodiscard]] int edges_per_segment() const { return edges_per_segment_; }
  /// As opened; any thread.
  [[nodiscard]] const scene::Linkage& opened() const { return linkage_; }

 private:
  using Conditions = LinkageOrder::Conditions;
  /// The discretisation error of a shape, with finer edges if it is too large.
  struct ShapeFinding {
    ShapeCheck check;
    std::shared_ptr<Refinement> refinement;  // null: none was tried
  };
  using ShapeChecks = BackgroundCheck<LinkageResult, ShapeFinding>;
  using ShapeFound = ShapeChecks::Found;
  /// One design, as the task runs it.
  struct DesignRound {
    DesignJob::Order order;
    Revision revision = 0;
    Conditions conditions;
  };

  /// Rules on conditions, which include the number of edges.
  using Rules = std::atomic<std::shared_ptr<const ConditionRules>>;
  static LinkageDocument document_of(const scene::Linkage& linkage, LinkageLimits limits,
                                     const std::shared_ptr<Rules>& rules);
  [[nodiscard]] std::shared_ptr<const ConditionRules> rules_for(int edges) const;
  static bool holds_where_it_is(const std::vector<LinkageEdit>& edits);

  // With the lock:
  Revision document_revision() const override { return document_.revision(); }
  LinkageOrder take_order() override;
  void demand_editable() const override;
  bool cancel_other_work() override;
  void note_cancel() override { design_.stop_any(); }
  void note_close() override {
    design_.stop_any();
    check_.stop();
  }
  void close_other_tasks(SerialTask::Wait wait) override { check_.close(wait); }
  [[nodiscard]] bool is_check_due() const;
  [[nodiscard]] bool may_refine() const;
  EditReceipt apply_design(std::optional<Revision> expected);

  // task.cpp:
  std::string build(const JobContext& job) override;
  void solve(const Round& round) override;
  void solve_failed(const Round& round, const std::string& reason) override;
  bool do_other_work(std::unique_lock<std::mutex>& lock) override;
  /// Designs take as long as builds, or longer: they leave a place to the checks of other sessions.
  [[nodiscard]] std::optional<Urgency> urgency_of_other_work() const override {
    return design_.is_waiting() ? std::optional(Urgency::kLong) : std::nullopt;
  }
  [[nodiscard]] LinkageGeometry describe() const;
  [[nodiscard]] ShapeFinding examine(const std::shared_ptr<const LinkageResult>& result,
                                     const JobContext& job);
  [[nodiscard]] bool adopt(Refinement& refinement, const LinkageResult& coarse);
  [[nodiscard]] std::shared_ptr<LinkageResult> final_of(LiveLinkage::Outcome outcome);
  void finish(const Round& round, LiveLinkage::Outcome outcome);
  void publish_iterate(const Round& round);
  void amend(const ShapeFound& found);
  void add_shape(LinkageResult& result) const;
  void name_edges(LinkageResult& result) const;
  [[nodiscard]] Eigen::VectorXd shape_now() const;

  // design_task.cpp:
  void run_design(const DesignRound& round);
  void search(const DesignRound& round, DesignInfo& info);
  bool between_steps(LiveDesign& design, DesignInfo& info, const DesignRound& round);
  void end_search(LiveDesign& design, DesignInfo& info, const DesignRound& round,
                  const rods::DesignReport& report);
  void find_erection(const LiveDesign& design, const DesignRound& round, DesignInfo& info);
  void publish_design(const LiveDesign* design, const DesignInfo& info, const DesignRound& round);
  [[nodiscard]] std::shared_ptr<LinkageResult> shape_from_before() const;
  bool end_design(DesignInfo& info);

  const scene::Linkage linkage_;
  const int most_chosen_edges_;
  const std::shared_ptr<Rules> rules_;  // null in it: edges are not chosen yet
  const std::shared_ptr<LinkageListener> design_listener_;

  // Under the lock:
  LinkageDocument document_;
  int edges_per_segment_;
  std::optional<RecalledAnswer> recalled_;  // no round has begun
  Revision held_where_it_was_ = 0;          // the newest with such a pin; 0: none
  bool has_named_edges_ =
      false;  // conditions had numbers of single edges, which undo may bring back
  DesignJob design_;
  std::shared_ptr<const LinkageGeometry> geometry_;
  std::shared_ptr<const LinkageShape> shape_;
  std::vector<LinkageOrder::DesignedEquilibrium> designed_equilibria_;  // no round has had them
  Conditions designed_;  // that the newest design was made under
  ShapeChecks check_;    // of final results

  std::unique_ptr<LiveLinkage> live_;                          // the task's
  EndedDesigns ended_;                                         // the task's
  std::unique_ptr<ShapeChecker> checker_;                      // the check's task's
  std::weak_ptr<const scene::LinkageConditions> not_refined_;  // the same: tried in vain
  std::shared_ptr<const LinkageGeometry> checked_;             // the same: what checker_ is of
};

}  // namespace limber::session
