#include "engine/session/linkage/linkage_session_impl.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/session/linkage/condition_rules.h"

namespace limber::session {

LinkageSession::Impl::Impl(std::string id, scene::Linkage linkage, LinkageLimits limits,
                           Executor executor, std::shared_ptr<LinkageListener> listener)
    : id_(std::move(id)),
      linkage_(std::move(linkage)),
      listener_(std::move(listener)),
      document_(opened(linkage_, limits)),
      task_(mutex_, std::move(executor), [this] { say_closed(); }),
      desk_(mutex_),
      edited_at_(Clock::now()) {}

/// Joints and segments must be known before the model is built.
LinkageDocument LinkageSession::Impl::opened(const scene::Linkage& linkage, LinkageLimits limits) {
  const LinkageCheck check = check_linkage(linkage);
  demand_sound(check);
  try {
    const auto rules = std::make_shared<const ConditionRules>(
        rods::build_linkage_graph(linkage.lines), linkage.edges_per_segment,
        linkage.length_unit_in_metres);
    limits.shape_bytes = rules->answer_bytes();
    return {
        linkage.conditions, check.joints, check.segments, limits,
        [rules](const scene::LinkageConditions& conditions) { return rules->check(conditions); }};
  } catch (const Error& error) {
    throw Error(error.code(), "conditions." + error.field(), error.what());
  }
}

void LinkageSession::Impl::demand_open() const {
  if (task_.is_closed()) throw Error(ErrorCode::kFailedPrecondition, "", "the session is closed");
  if (state_ == State::kFailed) {
    throw Error(ErrorCode::kFailedPrecondition, "",
                fmt::format("the session has no model: {}", message_));
  }
}

void LinkageSession::Impl::post(std::unique_lock<std::mutex> lock) {
  task_.post(
      std::move(lock), [self = shared_from_this()] { self->run(); }, message_);
}

void LinkageSession::Impl::open() {
  std::unique_lock lock(mutex_);
  work_ = true;
  post(std::move(lock));
  lock = std::unique_lock(mutex_);
  if (state_ == State::kBuilding && !task_.is_pending() && !message_.empty())
    throw Error(ErrorCode::kInternal, "", message_);
}

/// A pin without a position holds the joint where the edits before have it, not where an iterate
/// on the way there happens to be.
bool LinkageSession::Impl::holds_where_it_is(const std::vector<LinkageEdit>& edits) {
  return std::any_of(edits.begin(), edits.end(), [](const LinkageEdit& edit) {
    const auto* const pin = std::get_if<PinJoint>(&edit);
    return pin != nullptr && pin->held && *pin->held != scene::Held::kAngle && !pin->position;
  });
}

/// What there was before an edit is solved to its end before the edit is looked at. Called with
/// the lock.
void LinkageSession::Impl::finish_first(Round round) {
  const Revision taken = first_.empty() ? taken_ : first_.back().revision;
  if (task_.is_running() && taken == round.revision && !work_) {
    must_finish_ = true;  // it is just being solved
  } else if (taken != round.revision || work_) {
    first_.push_back(std::move(round));
  }
}

EditReceipt LinkageSession::Impl::edit(const std::vector<LinkageEdit>& edits,
                                       std::optional<Revision> expected) {
  const std::lock_guard one_at_a_time(edits_);
  const auto demand_editable = [this] {
    demand_open();
    if (desk_.is_under_way()) {
      throw Error(ErrorCode::kFailedPrecondition, "",
                  "a design is under way: change that, or stop or take it first");
    }
  };
  {
    const std::lock_guard lock(mutex_);
    demand_editable();
  }
  LinkageDocument::Prepared prepared = document_.prepare(edits, expected);
  std::unique_lock lock(mutex_);
  demand_editable();
  Round before = {document_.revision(),           document_.conditions(), edited_at_, {}, {},
                  document_.steps_before_return()};
  EditReceipt receipt = document_.commit(std::move(prepared));
  if (holds_where_it_is(edits)) finish_first(std::move(before));
  edited_at_ = Clock::now();
  work_ = true;
  cancelled_ = false;
  if (!must_finish_) round_.request();
  post(std::move(lock));
  return receipt;
}

void LinkageSession::Impl::cancel() {
  const std::lock_guard lock(mutex_);
  if (!task_.is_pending()) return;
  if (desk_.is_running()) return stop_design();
  if (state_ == State::kBuilding) building_.request();
  cancelled_ = true;
  first_.clear();
  round_.request();
  desk_.stop_any();
}

void LinkageSession::Impl::shut(SerialTask::Farewell farewell) {
  std::unique_lock lock(mutex_);
  state_ = State::kClosed;
  building_.request();
  round_.request();
  desk_.stop_any();
  task_.close(std::move(lock), farewell);
}

}  // namespace limber::session
