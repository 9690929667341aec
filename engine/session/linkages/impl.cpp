#include "engine/session/linkages/impl.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/session/linkages/condition_rules.h"

namespace limber::session {

LinkageSession::Impl::Impl(std::string id, scene::Linkage linkage, LinkageLimits limits,
                           Executor executor, std::shared_ptr<LinkageListener> listener)
    : SessionCore(std::move(id), executor, listener),
      linkage_(std::move(linkage)),
      design_listener_(std::move(listener)),
      document_(document_of(linkage_, limits)),
      design_(mutex_),
      check_(
          mutex_, std::move(executor),
          [this](const LinkageResult& result, const JobContext& job) {
            if (!checker_) {
              checker_ =
                  std::make_unique<ShapeChecker>(result.statics->model(), linkage_.tolerance);
            }
            return checker_->check(result, job);
          },
          [this] { post(std::unique_lock(mutex_)); }) {}

/// Joints and segments must be known before the model is built.
LinkageDocument LinkageSession::Impl::document_of(const scene::Linkage& linkage,
                                                  LinkageLimits limits) {
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

/// A pin without a position holds the joint where the edits before have it, not where an iterate
/// along the path there happens to be.
bool LinkageSession::Impl::holds_where_it_is(const std::vector<LinkageEdit>& edits) {
  return std::any_of(edits.begin(), edits.end(), [](const LinkageEdit& edit) {
    const auto* const pin = std::get_if<PinJoint>(&edit);
    return pin != nullptr && pin->held && *pin->held != scene::Held::kAngle && !pin->position;
  });
}

void LinkageSession::Impl::demand_editable() const {
  demand_model();
  if (design_.is_active()) {
    throw Error(ErrorCode::kFailedPrecondition, "",
                "a design is running: change it, or stop or take it first");
  }
}

EditReceipt LinkageSession::Impl::edit(const std::vector<LinkageEdit>& edits,
                                       std::optional<Revision> expected) {
  std::optional<LinkageDocument::Prepared> prepared;
  return change([&] { prepared.emplace(document_.prepare(edits, expected)); },
                [&] {
                  if (holds_where_it_is(edits))
                    finish_first(document_.revision(),
                                 {document_.conditions(), {}, document_.steps_before_return()});
                  check_.stop();
                  return document_.commit(std::move(*prepared));
                });
}

LinkageOrder LinkageSession::Impl::take_order() {
  return {document_.conditions(), std::exchange(designed_equilibria_, {}),
          document_.steps_before_return()};
}

bool LinkageSession::Impl::cancel_other_work() {
  if (!design_.is_running()) return false;
  stop_design();
  return true;
}

}  // namespace limber::session
