#include "engine/session/beams/session.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/base/rotations/logarithm.h"
#include "engine/session/beams/live_problem.h"
#include "engine/session/core/matrix_of_columns.h"
#include "engine/session/core/session_core.h"

namespace limber::session {
namespace {

/// Nodes in a shape that is known to be the newest; null: it is not.
class EquilibriumPositions final : public BeamDocument::Places {
 public:
  EquilibriumPositions(const BeamDocument& document, std::shared_ptr<const BeamResult> settled)
      : document_(document), settled_(std::move(settled)) {}

  [[nodiscard]] beams::PrescribedMotion of(int node) const override {
    if (!settled_ || !settled_->analysis)
      throw Error(ErrorCode::kFailedPrecondition, "node",
                  fmt::format("node {} is not at rest yet: wait for revision {}", node,
                              document_.revision()));
    const beams::BeamState& state = settled_->analysis->solution.state;
    const auto i = static_cast<std::size_t>(node);
    beams::PrescribedMotion motion;
    motion.node = node;
    motion.translates = motion.rotates = {true, true, true};
    motion.translation = state.positions.col(node) - document_.model().nodes[i].position;
    motion.rotation = rotations::logarithm(state.rotations[i]);
    return motion;
  }

 private:
  const BeamDocument& document_;
  std::shared_ptr<const BeamResult> settled_;
};

}  // namespace

/// The order that the task of a session of beams works on.
struct BeamOrder {
  std::shared_ptr<const BeamConditions> conditions;
};

class BeamSession::Impl final : public SessionCore<BeamResult, BeamOrder> {
 public:
  Impl(std::string id, beams::BeamModel model, BeamLimits limits, Executor executor,
       std::shared_ptr<BeamListener> listener, std::optional<beams::BeamState> shape,
       beams::BeamDiscretisation discretisation)
      : SessionCore(std::move(id), std::move(executor), std::move(listener)),
        document_(std::move(model), limits),
        discretisation_(discretisation),
        live_(document_.model(), std::move(shape), discretisation) {}

  EditReceipt edit(const std::vector<BeamEdit>& edits, std::optional<Revision> expected,
                   const Author& author);
  void begin_at(BeamDocument::Checkpoint checkpoint);
  [[nodiscard]] BeamDocument::Checkpoint checkpoint() const {  // with the lock
    demand_answer_of(pushed_);
    return document_.checkpoint();
  }

  /// Its revision changes under the lock; its rules for edits never change.
  [[nodiscard]] const BeamDocument& document() const { return document_; }

 private:
  std::string build(const JobContext&) override { return {}; }  // nothing takes time
  Revision document_revision() const override { return document_.revision(); }
  BeamOrder take_order() override { return {document_.conditions()}; }
  void solve(const Round& round) override;
  void solve_failed(const Round& round, const std::string& reason) override;
  bool must_finish(const BeamOrder& order) const override {
    return selects_buckling_direction(*order.conditions);
  }

  void interrupt_round() override;
  void note_close() override { check_cancellation_.request(); }
  bool cancel_other_work() override;
  bool do_other_work(std::unique_lock<std::mutex>& lock) override;
  [[nodiscard]] std::optional<Urgency> urgency_of_other_work() const override {
    return is_check_due() ? std::optional(Urgency::kPatient) : std::nullopt;
  }
  [[nodiscard]] bool is_check_due() const;

  [[nodiscard]] bool selects_buckling_direction(const BeamConditions& conditions) const;
  /// Refines an equilibrium until it meets the tolerance. @returns the check of the refined
  /// equilibrium; null after a cancellation
  std::shared_ptr<const DiscretisationCheck> meet_tolerance(const Round& round,
                                                            LiveBeams::Outcome& outcome);
  void finish(const Round& round, LiveBeams::Outcome outcome,
              std::shared_ptr<const DiscretisationCheck> check = nullptr);
  void publish_shape(const beams::BeamState& state, const Round& round);
  void publish_iterate(const beams::BeamState& state, const Round& round);
  void amend(const BeamResult& checked, const Cancellation& cancellation);

  BeamDocument document_;
  const beams::BeamDiscretisation discretisation_;
  LiveBeams live_;  // the task's
  // Under the lock:
  Revision pushed_ = 0;                // the newest with temporary loads; 0: none
  std::uint64_t check_begun_for_ = 0;  // sequence of the result; 0: none
  bool is_checking_ = false;
  Cancellation check_cancellation_;
};

/// Do pushes act, or temporary loads of the structure, which is in no equilibrium yet? Called with
/// the lock.
bool BeamSession::Impl::selects_buckling_direction(const BeamConditions& conditions) const {
  const bool is_solved = final_ && final_->analysis;
  return !conditions.temporary_loads.empty() ||
         (!is_solved && !document_.model().temporary_loads.empty());
}

EditReceipt BeamSession::Impl::edit(const std::vector<BeamEdit>& edits,
                                    std::optional<Revision> expected, const Author& author) {
  std::optional<BeamDocument::Prepared> prepared;
  return change(
      [&] {
        const auto settled = read([this]() -> std::shared_ptr<const BeamResult> {
          const bool is_settled = final_ && final_->revision == document_.revision() && !has_work_;
          return is_settled ? final_ : nullptr;
        });
        prepared.emplace(
            document_.prepare(edits, expected, EquilibriumPositions(document_, settled), author));
      },
      [&] {
        // A step with temporary loads is solved to its end before the next edit is read.
        if (has_work_ && selects_buckling_direction(*document_.conditions()))
          finish_first(document_.revision(), {document_.conditions()});
        EditReceipt receipt = document_.commit(std::move(*prepared));
        if (!document_.conditions()->temporary_loads.empty()) pushed_ = document_.revision();
        return receipt;
      });
}

void BeamSession::Impl::begin_at(BeamDocument::Checkpoint checkpoint) {
  change(
      [&] {
        demand_unedited();
        document_.demand_reachable(checkpoint);
      },
      [&] {
        document_.begin_at(std::move(checkpoint));
        return EditReceipt{document_.revision(), {}, {}, {}};
      });
}

void BeamSession::Impl::solve(const Round& round) {
  LiveBeams::Outcome outcome =
      live_.solve(round.order.conditions, JobContext{round.cancellation, {}},
                  [&](const beams::BeamState& state) { publish_iterate(state, round); });
  std::shared_ptr<const DiscretisationCheck> check;
  if (outcome.reached && discretisation_.is_chosen()) {
    check = meet_tolerance(round, outcome);
    if (!check && is_out_of_date()) return;
    if (!check) outcome.report.message += "; its refinement to the tolerance was cancelled";
  }
  finish(round, std::move(outcome), std::move(check));
}

std::shared_ptr<const DiscretisationCheck> BeamSession::Impl::meet_tolerance(
    const Round& round, LiveBeams::Outcome& outcome) {
  const JobContext job{round.cancellation, {}};
  // Loads that choose a side have done so: the equilibrium is there.
  allow_interruption();
  try {
    while (true) {
      std::shared_ptr<const DiscretisationCheck> check = live_.check(job);
      if (check->is_fine_enough()) return check;
      publish_shape(live_.state(), round);
      if (!live_.refine(job)) return check;
      outcome.report = live_.analysis()->solution.report;
      outcome.frames.push_back(beam_coordinates(live_.state()));
    }
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
    return nullptr;
  }
}

void BeamSession::Impl::interrupt_round() {
  round_.request();
  check_cancellation_.request();
}

bool BeamSession::Impl::cancel_other_work() {
  if (!is_checking_) return false;
  check_cancellation_.request();
  return true;
}

/// The check of a final result, at the end of all work; an edit interrupts it.
bool BeamSession::Impl::is_check_due() const {
  return newest_ && newest_ == final_ && newest_->check == Check::kPending &&
         newest_->sequence != check_begun_for_;
}

bool BeamSession::Impl::do_other_work(std::unique_lock<std::mutex>& lock) {
  if (!is_check_due()) return false;
  const SharedResult result = newest_;
  check_begun_for_ = result->sequence;
  is_checking_ = true;
  is_finishing_ = false;
  check_cancellation_ = Cancellation();
  const Cancellation cancellation = check_cancellation_;
  lock.unlock();
  try {
    amend(*result, cancellation);
  } catch (...) {  // out of memory, or a listener's
    lock.lock();
    is_checking_ = false;
    throw;
  }
  lock.lock();
  is_checking_ = false;
  return true;
}

/// Publishes a result again with the findings of its check.
void BeamSession::Impl::amend(const BeamResult& checked, const Cancellation& cancellation) {
  auto result = std::make_shared<BeamResult>(checked);
  result->check = Check::kDone;
  std::string remark;
  try {
    result->discretisation = live_.check({cancellation, {}});
    if (const auto judged = live_.analysis(); judged != checked.analysis) {
      result->analysis = judged;
      result->report = judged->solution.report;
    }
    remark = describe_discretisation(*result->discretisation);
  } catch (const std::exception& error) {
    remark = fmt::format("The discretisation error could not be estimated: {}", error.what());
  }
  if (!remark.empty()) result->report.message += ". " + remark;
  const Revision revision = checked.revision;
  publish_if(std::move(result),
             [&] { return !has_work_ && newest_ == final_ && newest_->revision == revision; });
}

void BeamSession::Impl::solve_failed(const Round& round, const std::string& reason) {
  live_.restore();
  LiveBeams::Outcome outcome;
  outcome.report.status = beams::BeamStatus::kStalled;
  outcome.report.message = reason;
  finish(round, std::move(outcome));
}

void BeamSession::Impl::finish(const Round& round, LiveBeams::Outcome outcome,
                               std::shared_ptr<const DiscretisationCheck> check) {
  const bool cancelled = outcome.report.status == beams::BeamStatus::kCancelled;
  const bool is_to_be_checked = outcome.reached && !discretisation_.is_chosen();
  if (cancelled && is_out_of_date()) return;
  if (cancelled) live_.restore();
  auto result = std::make_shared<BeamResult>();
  result->is_final = true;
  result->solve_failed = !outcome.reached && !cancelled;
  result->report = std::move(outcome.report);
  result->frames = matrix_of_columns(
      outcome.reached ? outcome.frames : std::vector{beam_coordinates(live_.state())});
  result->analysis = live_.analysis();
  if (check) {
    add_sentence(result->report.message, describe_discretisation(*check));
    result->discretisation = std::move(check);
  } else if (is_to_be_checked) {
    result->check = Check::kPending;
  }
  publish(std::move(result), round);
}

void BeamSession::Impl::publish_iterate(const beams::BeamState& state, const Round& round) {
  if (is_time_to_publish()) publish_shape(state, round);
}

void BeamSession::Impl::publish_shape(const beams::BeamState& state, const Round& round) {
  auto result = std::make_shared<BeamResult>();
  result->frames = matrix_of_columns(std::vector{beam_coordinates(state)});
  publish(std::move(result), round);
}

BeamSession::BeamSession(std::string id, beams::BeamModel model, BeamLimits limits,
                         Executor executor, std::shared_ptr<BeamListener> listener,
                         std::optional<beams::BeamState> shape,
                         beams::BeamDiscretisation discretisation)
    : impl_(std::make_shared<Impl>(std::move(id), std::move(model), limits, std::move(executor),
                                   std::move(listener), std::move(shape), discretisation)) {
  impl_->open();
}
BeamSession::~BeamSession() { impl_->shut(Impl::CloseNotification::kNone); }

const std::string& BeamSession::id() const { return impl_->id(); }
State BeamSession::state() const { return impl_->state(); }
Revision BeamSession::revision() const {
  return impl_->read([this] { return impl_->document().revision(); });
}
beams::BeamModel BeamSession::model() const {
  const beams::BeamModel& opened = impl_->document().model();
  beams::BeamModel model = with_conditions(opened, *conditions());
  model.temporary_loads.insert(model.temporary_loads.begin(), opened.temporary_loads.begin(),
                               opened.temporary_loads.end());
  return model;
}
std::shared_ptr<const BeamConditions> BeamSession::conditions() const {
  return impl_->read([this] { return impl_->document().conditions(); });
}
EditReceipt BeamSession::edit(const std::vector<BeamEdit>& edits, std::optional<Revision> expected,
                              const Author& author) {
  return impl_->edit(edits, expected, author);
}
BeamDocument::Checkpoint BeamSession::checkpoint() const {
  return impl_->read([this] { return impl_->checkpoint(); });
}
void BeamSession::demand_reachable(const BeamDocument::Checkpoint& checkpoint) const {
  impl_->document().demand_reachable(checkpoint);
}
void BeamSession::begin_at(BeamDocument::Checkpoint checkpoint) {
  impl_->begin_at(std::move(checkpoint));
}
void BeamSession::cancel() { impl_->cancel(); }
void BeamSession::close() { impl_->shut(Impl::CloseNotification::kSent); }
std::shared_ptr<const BeamResult> BeamSession::newest_result() const {
  return impl_->newest_result();
}
std::shared_ptr<const BeamResult> BeamSession::final_result() const {
  return impl_->final_result();
}

}  // namespace limber::session
