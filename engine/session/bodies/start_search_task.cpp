#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/session/bodies/impl.h"
#include "engine/session/bodies/weight_scale.h"

// Further starts, behind final exact results that were checked: found by a task of their own
// (start_search.h), taken over by the session's task, so that results keep their order. A newer
// edit interrupts both.

namespace limber::session {

using spacetime::SolveStatus;

namespace {

constexpr double kUnpublished = -std::numeric_limits<double>::infinity();
/// Share of a motion by which it may have changed since starts were compared for it.
constexpr double kNearMotion = 0.5;

}  // namespace

int BodySession::Impl::constraint_count() const {
  return static_cast<int>(problem_->solver().constraints().size());
}

int BodySession::Impl::starts_to_compare() const {
  const StartSearchOptions& options = *options_.start_search;
  const scene::Scene& scene = *document_.unedited();
  const int count = constraint_count();
  const auto tets = static_cast<int>(scene.mesh.tet_count());
  if (count < 2 || count > options.most_constraints || tets > options.most_tets ||
      scene.frame_count > options.most_frames)
    return 0;
  return options.starts_within(count, scene.frame_count, tets);
}

bool BodySession::Impl::is_several_optima_possible(const BodyResult& result) const {
  if (!options_.start_search) return false;
  const SolveStatus status = result.report.status;
  if (status == SolveStatus::kCancelled || status == SolveStatus::kImproved) return false;
  if (!result.is_exact || result.report.rank_deficient || result.starts || result.solve_failed)
    return false;
  if (problem_->variables() != scene::MaterialVariables::kMotion || problem_->has_fitted() ||
      problem_->has_keyframes())
    return false;
  if (starts_to_compare() == 0) return false;
  double farthest = 0;
  for (const spacetime::PositionConstraint& constraint : problem_->solver().constraints())
    if (!constraint.is_velocity()) farthest = std::max(farthest, constraint.target.norm());
  return farthest >=
         options_.start_search->least_reach * read([this] { return built_->model->length; });
}

/// Called with the lock.
bool BodySession::Impl::is_search_due() const {
  return newest_ && newest_ == final_ && newest_->awaits_starts && newest_->check == Check::kDone &&
         search_.is_new(*newest_) && !is_searching_;
}

bool BodySession::Impl::do_search_work(std::unique_lock<std::mutex>& lock) {
  if (std::exchange(is_search_cancelled_, false)) {
    auto again = std::make_shared<BodyResult>(*newest_);
    lock.unlock();
    again->awaits_starts = false;
    publish(std::move(again));
    return true;
  }
  if (const auto found = search_.take()) {
    is_searching_ = false;
    const bool is_newest = found->result == newest_;
    lock.unlock();
    if (is_newest) adopt_start(*found);
    return true;
  }
  if (!is_search_due()) return false;
  begin_search(lock);
  return true;
}

/// Takes the lock, may leave without it.
void BodySession::Impl::begin_search(std::unique_lock<std::mutex>& lock) {
  const auto result = newest_;
  search_.claim(*result);
  is_searching_ = true;
  lock.unlock();
  StartRequest request;
  try {
    request.problem = problem_->mode_problem(dynamics_);
    provide_full();
    request.result = result;
    request.body = full_body_->parts();
    request.modes = modes_;
    request.starts = starts_to_compare();
  } catch (const std::exception& error) {
    if (read([this] { return std::exchange(is_searching_, false); }))  // else an edit was quicker
      adopt_start({result, {}, error.what()});
    return;
  }
  lock.lock();
  request.model = built_->model;
  search_.begin(lock, result, std::move(request), shared_from_this());
}

/// Publishes the final result again, with the compared optima, or a lower optimum in its place.
void BodySession::Impl::adopt_start(const StartsFound& found) {
  searched_ = found.result->modal;
  searched_constraints_ = constraint_count();
  std::shared_ptr<BodyResult> better;
  if (found.finding && found.finding->motion.size() > 0) {
    Round round;
    {
      const std::lock_guard lock(mutex_);
      if (has_work_ || task_.is_closed()) return;  // an edit was quicker
      round_ = Cancellation();
      round.revision = document_.revision();
      round.edited_at = edited_at_;
      round.order.content = document_.content();
      round.order.cold_request = cold_taken_;
      round.cancellation = round_;
    }
    better = with_start(*found.finding, *found.result, round);
    if (newest_result() != found.result) return;
    if (better) {
      searched_ = better->modal;
      solved_ = true;
      tried_ = better->modal;
      publish_of_round(better, round);
      answers_.keep(round.order.content, better);
      return;
    }
  }
  auto again = std::make_shared<BodyResult>(*found.result);
  again->awaits_starts = false;
  if (found.finding) {
    again->starts = found.finding->comparison;
    add_sentence(again->report.message,
                 describe_starts(
                     *again->starts, document_.unedited()->length_unit_in_metres,
                     found.finding->motion.size() > 0 ? ShownStart::kBefore : ShownStart::kLowest));
  } else {
    add_sentence(again->report.message,
                 fmt::format("Further starts could not be compared: {}", found.failure));
  }
  publish(std::move(again));
}

/// @returns nothing where it is not better after all, or an edit was quicker
std::shared_ptr<BodyResult> BodySession::Impl::with_start(const StartFinding& finding,
                                                          const BodyResult& before,
                                                          const Round& round) {
  spacetime::Solver& solver = problem_->solver();
  const Eigen::MatrixXd motion = solver.motion();
  auto corrections = problem_->take_corrections();
  solver.warm_start(finding.motion, spacetime::Known::kAnswer);
  spacetime::SolveReport start;
  start.total_energy = 0;
  std::optional<spacetime::SolveReport> report = polish(round, start, kUnpublished);
  if (report && is_exact_ && solver.prefers(*report, before.report)) {
    add_sentence(report->message,
                 fmt::format("A lower {} was found from another start: total energy {:.6g} "
                             "instead of {:.6g}.",
                             report->status == SolveStatus::kConverged ? "optimum" : "motion",
                             report->total_energy, before.report.total_energy));
    add_sentence(report->message,
                 describe_starts(finding.comparison, document_.unedited()->length_unit_in_metres));
    report_missed_tolerance(*document_.unedited(), solver.weight_scale(), *report);
    if (auto result = result_of_motion(round, *report, true); result && result->is_exact) {
      result->starts = finding.comparison;
      result->awaits_starts = false;
      return result;
    }
  }
  problem_->give_back(std::move(corrections));
  solver.warm_start(motion, spacetime::Known::kAnswer);
  is_exact_ = true;
  return nullptr;
}

bool BodySession::Impl::is_searched(const Eigen::MatrixXd& motion) const {
  return searched_constraints_ == constraint_count() && searched_.rows() == motion.rows() &&
         searched_.cols() == motion.cols() &&
         (motion - searched_).norm() <= kNearMotion * searched_.norm();
}

}  // namespace limber::session
