#include <fmt/format.h>

#include <utility>

#include "engine/base/hash.h"
#include "engine/session/core/matrix_of_columns.h"
#include "engine/session/linkages/edge_choice.h"
#include "engine/session/linkages/impl.h"

namespace limber::session {
namespace {

void add_remark(LinkageResult& result, const std::string& remark) {
  if (remark.empty()) return;
  std::string& message = result.report.message;
  if (message.find(remark) != std::string::npos) return;  // of an answer that came back with it
  message += (message.empty() ? "" : "; ") + remark;
}

}  // namespace

std::string LinkageSession::Impl::build(const JobContext& job) {
  report_progress("linkage", 0);
  std::string message;
  try {
    scene::Linkage linkage = linkage_;
    if (linkage.edges_per_segment == 0) {
      linkage.conditions = *read([this] { return document_.conditions(); });
      EdgeChoice choice = choose_edges(linkage, most_chosen_edges_, job);
      linkage.conditions = linkage_.conditions;
      linkage.edges_per_segment = choice.edges;
      message = std::move(choice.message);
      rules_->store(rules_for(choice.edges));
    }
    live_ = std::make_unique<LiveLinkage>(linkage, job);
    auto geometry = std::make_shared<const LinkageGeometry>(describe());
    const std::lock_guard lock(mutex_);
    edges_per_segment_ = linkage.edges_per_segment;
    geometry_ = std::move(geometry);
    shape_ = std::make_shared<const LinkageShape>(live_->shape());
  } catch (...) {
    live_.reset();
    throw;
  }
  return message;
}

LinkageGeometry LinkageSession::Impl::describe() const {
  const rods::LinkageModel& model = live_->model();
  const LinkageShape& shape = live_->shape();
  LinkageGeometry geometry;
  geometry.coordinates = shape.size();
  geometry.outline = shape.outline();
  geometry.surface = shape.triangles();
  geometry.surface_nodes = shape.surface_nodes();
  const auto& segments = model.graph().segments;
  geometry.joints_of_segment.resize(2, static_cast<Eigen::Index>(segments.size()));
  for (std::size_t s = 0; s < segments.size(); ++s) {
    geometry.edges.push_back(model.variables().edges(static_cast<int>(s)));
    geometry.joints_of_segment.col(static_cast<Eigen::Index>(s)) << segments[s].joints[0],
        segments[s].joints[1];
  }
  for (const auto& joint : model.graph().joints) geometry.vertex_of_joint.push_back(joint.vertex);
  geometry.rods = rods::rod_chains(model.graph());
  geometry.mixed_angles = model.graph().mixed_angles;
  ContentHash hash;
  hash.add("limber linkage 1").add_array(geometry.edges.data(), geometry.edges.size());
  geometry.hash = hash.hex();
  return geometry;
}

/// True if limber chose the number of edges and the document depends on no number: designs and rest
/// lengths of edges do.
bool LinkageSession::Impl::may_refine() const {
  return read([this] {
    return linkage_.edges_per_segment == 0 && edges_per_segment_ < most_chosen_edges_ &&
           !has_named_edges_ && design_.info() == nullptr;
  });
}

/// The check's task's.
LinkageSession::Impl::ShapeFinding LinkageSession::Impl::examine(
    const std::shared_ptr<const LinkageResult>& result, const JobContext& job) {
  if (checked_ != result->geometry) {
    checker_ = std::make_unique<ShapeChecker>(*result->statics, linkage_.tolerance);
    checked_ = result->geometry;
  }
  ShapeFinding finding{checker_->check(*result, job), nullptr};
  const ShapeCheck& check = finding.check;
  if (check.within_tolerance() || !check.error.is_known() || !may_refine()) return finding;
  if (not_refined_.lock() == result->requested) return finding;  // tried before
  finding.refinement = std::make_shared<Refinement>(
      refine(linkage_, *result, check, read([this] { return edges_per_segment_; }),
             most_chosen_edges_, job));
  if (!finding.refinement->live) not_refined_ = result->requested;
  return finding;
}

/// The session continues with more edges: later edits begin in their equilibrium.
/// @returns false where it has moved on, or has numbers of single edges by now
bool LinkageSession::Impl::adopt(Refinement& refinement, const LinkageResult& coarse) {
  auto rules = rules_for(refinement.edges);
  std::swap(live_, refinement.live);
  auto result = final_of(std::move(refinement.outcome));
  result->geometry = std::make_shared<const LinkageGeometry>(describe());
  result->shape = std::make_shared<const LinkageShape>(live_->shape());
  result->requested = coarse.requested;
  result->revision = coarse.revision;
  result->since_edit_ms = coarse.since_edit_ms;
  result->check = Check::kDone;
  result->shape_check = std::make_shared<const ShapeCheck>(refinement.check);
  add_remark(*result, fmt::format("{} edges per segment in place of {}, for the tolerance",
                                  refinement.edges, read([this] { return edges_per_segment_; })));
  add_remark(*result, describe_shape(refinement.check));
  SharedResult older, older_final;
  {
    const std::lock_guard no_edit(edits_);  // none was prepared by the rules of before
    const std::lock_guard lock(mutex_);
    const bool is_needed =
        !task_.is_closed() && !has_work_ && !has_named_edges_ && design_.info() == nullptr;
    if (!is_needed) {
      std::swap(live_, refinement.live);
      return false;
    }
    edges_per_segment_ = refinement.edges;
    geometry_ = result->geometry;
    shape_ = result->shape;
    rules_->store(std::move(rules));
    set_newest(result, older, older_final);
  }
  notify(listener_.get(), [&](Listener<LinkageResult>& listener) { listener.on_result(result); });
  return true;
}

/// Called with the lock.
bool LinkageSession::Impl::is_check_due() const {
  return newest_ && newest_ == final_ && newest_->check == Check::kPending &&
         check_.is_new(*newest_);
}

/// Publishes a result again with the findings of its check.
void LinkageSession::Impl::amend(const ShapeFound& found) {
  auto result = std::make_shared<LinkageResult>(*found.result);
  result->check = Check::kDone;
  result->check_failure = found.failure;
  if (found.finding) {
    const std::shared_ptr<Refinement>& refinement = found.finding->refinement;
    if (refinement && refinement->live && adopt(*refinement, *found.result)) return;
    result->shape_check = std::make_shared<const ShapeCheck>(found.finding->check);
    add_remark(*result, describe_shape(found.finding->check));
    if (refinement) add_remark(*result, refinement->failure);
  }
  publish(std::move(result));
}

/// Designs come after earlier edits, and before the checks of their results.
bool LinkageSession::Impl::do_other_work(std::unique_lock<std::mutex>& lock) {
  if (!design_.is_waiting()) {
    if (const auto found = check_.take()) {
      const bool is_newest = found->result == newest_;
      lock.unlock();
      if (is_newest) amend(*found);
      return true;
    }
    if (!is_check_due()) return false;
    check_.claim(*newest_);
    check_.begin(lock, newest_, newest_, shared_from_this());
    return true;
  }
  designed_ = document_.conditions();
  const DesignRound round{design_.take_order(), document_.revision(), designed_};
  lock.unlock();
  run_design(round);
  return true;
}

/// For large linkages, a first shape, corrected with the available factor, is shown as soon as it
/// exists; small ones reach equilibrium before another picture is due.
void LinkageSession::Impl::solve(const Round& round) {
  const std::optional<RecalledAnswer> recalled =
      read([this] { return std::exchange(recalled_, std::nullopt); });
  if (recalled && recalled->revision == round.revision)
    (void)live_->recall(round.order.conditions, *recalled);
  if (live_->is_slow()) publish_next_iterate();
  for (const auto& known : round.order.designed)
    live_->add_guess(known.conditions, known.candidate->deployed);
  finish(round, live_->solve(
                    round.order.conditions, JobContext{round.cancellation, {}},
                    [&] { publish_iterate(round); }, round.order.origins));
}

void LinkageSession::Impl::solve_failed(const Round& round, const std::string& reason) {
  live_->restore();
  LiveLinkage::Outcome outcome;
  outcome.report.status = rods::EquilibriumStatus::kStalled;
  outcome.report.message = reason;
  finish(round, std::move(outcome));
}

void LinkageSession::Impl::finish(const Round& round, LiveLinkage::Outcome outcome) {
  const bool cancelled = outcome.report.status == rods::EquilibriumStatus::kCancelled;
  if (cancelled && is_out_of_date()) {  // a newer revision continues from this iterate
    live_->stay_near();
    return;
  }
  if (cancelled) live_->restore();
  std::shared_ptr<LinkageResult> result = final_of(std::move(outcome));
  result->requested = round.order.conditions;
  publish(std::move(result), round);
}

std::shared_ptr<LinkageResult> LinkageSession::Impl::final_of(LiveLinkage::Outcome outcome) {
  const bool cancelled = outcome.report.status == rods::EquilibriumStatus::kCancelled;
  auto result = std::make_shared<LinkageResult>();
  result->is_final = true;
  result->solve_failed = !outcome.reached && !cancelled;
  result->report = outcome.reached ? outcome.report : live_->report_of_shape(outcome.report);
  const bool moved = !cancelled && !outcome.path.empty();
  if (moved) result->path = std::move(outcome.path);
  result->frames =
      moved ? matrix_of_columns(outcome.frames) : matrix_of_columns(std::vector{shape_now()});
  result->strains = moved
                        ? matrix_of_columns(outcome.strains)
                        : matrix_of_columns(std::vector{live_->statics()->strains(live_->state())});
  result->statics = live_->statics();
  result->state = std::make_shared<const rods::LinkageState>(live_->state());
  result->conditions =
      std::make_shared<const scene::LinkageConditions>(live_->conditions_of_shape());
  result->held = std::make_shared<const rods::Conditions>(live_->held());
  if (outcome.reached) result->check = Check::kPending;
  add_shape(*result);
  return result;
}

void LinkageSession::Impl::publish_iterate(const Round& round) {
  if (!is_time_to_publish()) return;
  auto result = std::make_shared<LinkageResult>();
  result->frames = matrix_of_columns(std::vector{shape_now()});
  add_shape(*result);
  publish(std::move(result), round);
}

Eigen::VectorXd LinkageSession::Impl::shape_now() const {
  return live_->shape().coordinates(live_->model(), live_->state());
}

/// Members common to all results of the task's own shape.
void LinkageSession::Impl::add_shape(LinkageResult& result) const {
  result.mean_angle = live_->state().mean_opening_angle();
  result.section_scales = live_->model().section_scales();
  name_edges(result);
}

void LinkageSession::Impl::name_edges(LinkageResult& result) const {
  const std::lock_guard lock(mutex_);
  result.geometry = geometry_;
  result.shape = shape_;
}

}  // namespace limber::session
