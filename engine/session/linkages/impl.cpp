#include "engine/session/linkages/impl.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/session/linkages/condition_rules.h"

namespace limber::session {

LinkageSession::Impl::Impl(std::string id, scene::Linkage linkage, LinkageLimits limits,
                           Executor executor, std::shared_ptr<LinkageListener> listener,
                           std::optional<RecalledAnswer> recalled)
    : SessionCore(std::move(id), executor, listener),
      linkage_(std::move(linkage)),
      most_chosen_edges_(limits.most_chosen_edges),
      rules_(std::make_shared<Rules>()),
      design_listener_(std::move(listener)),
      document_(document_of(linkage_, limits, rules_)),
      edges_per_segment_(linkage_.edges_per_segment),
      recalled_(std::move(recalled)),
      design_(mutex_),
      check_(
          mutex_, std::move(executor),
          [this](const std::shared_ptr<const LinkageResult>& result, const JobContext& job) {
            return examine(result, job);
          },
          [this] { post(std::unique_lock(mutex_)); }) {}

/// Joints and segments must be known before the model is built; edges need not be.
LinkageDocument LinkageSession::Impl::document_of(const scene::Linkage& linkage,
                                                  LinkageLimits limits,
                                                  const std::shared_ptr<Rules>& rules) {
  const LinkageCheck check = check_linkage(linkage);
  demand_sound(check);
  try {
    const auto first =
        std::make_shared<const ConditionRules>(rods::build_linkage_graph(linkage.lines),
                                               first_edges(linkage), linkage.length_unit_in_metres);
    limits.shape_bytes = first->answer_bytes();
    if (linkage.edges_per_segment > 0) rules->store(first);
    return {linkage.conditions, check.joints, check.segments, limits,
            [first, rules](const scene::LinkageConditions& conditions) {
              if (const auto known = rules->load()) return known->check(conditions);
              if (conditions.edge_lengths.size() == 0) return first->check(conditions);
              return std::vector<scene::Issue>{
                  {scene::Issue::Severity::kError, "edge_lengths",
                   "edges are chosen while the session is built: wait until it is ready",
                   ErrorCode::kFailedPrecondition}};
            }};
  } catch (const Error& error) {
    throw Error(error.code(), "conditions." + error.field(), error.what());
  }
}

std::shared_ptr<const ConditionRules> LinkageSession::Impl::rules_for(int edges) const {
  return std::make_shared<const ConditionRules>(rods::build_linkage_graph(linkage_.lines), edges,
                                                linkage_.length_unit_in_metres);
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
                                       std::optional<Revision> expected, const Author& author) {
  std::optional<LinkageDocument::Prepared> prepared;
  return change([&] { prepared.emplace(document_.prepare(edits, expected, author)); },
                [&] {
                  // An answer that came back has the joint where it was held already.
                  const bool is_answered = recalled_ && document_.revision() < recalled_->revision;
                  if (holds_where_it_is(edits) && !is_answered)
                    finish_first(document_.revision(),
                                 {document_.conditions(), {}, document_.steps_before_return()});
                  check_.stop();
                  EditReceipt receipt = document_.commit(std::move(*prepared));
                  if (holds_where_it_is(edits)) held_where_it_was_ = document_.revision();
                  if (document_.conditions()->edge_lengths.size() > 0) has_named_edges_ = true;
                  return receipt;
                });
}

void LinkageSession::Impl::begin_at(LinkageDocument::Checkpoint checkpoint) {
  change(
      [&] {
        demand_unedited();
        document_.demand_reachable(checkpoint);
      },
      [&] {
        for_each_snapshot(checkpoint.history, [&](const scene::LinkageConditions& conditions) {
          if (conditions.edge_lengths.size() > 0) has_named_edges_ = true;
        });
        document_.begin_at(std::move(checkpoint));
        return EditReceipt{document_.revision(), {}, {}, {}};
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
