#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/scene/start_motion.h"
#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/impl.h"
#include "engine/session/bodies/material_outcome.h"
#include "engine/session/bodies/reach.h"
#include "engine/session/bodies/weight_scale.h"
#include "engine/spacetime/motion_spectrum.h"

namespace limber::session {
namespace {

using Seconds = std::chrono::duration<double>;

void demand_finite(const spacetime::SolveReport& report, const Eigen::MatrixXd& motion) {
  if (!std::isfinite(report.total_energy) || !motion.allFinite()) {
    throw Error(ErrorCode::kNumerical, "", "the solve left the finite numbers");
  }
}

}  // namespace

std::string BodySession::Impl::build(const JobContext& job) {
  const auto begin = Clock::now();
  try {
    auto built = std::make_shared<Built>(build_model(job));
    built->seconds = Seconds(Clock::now() - begin).count();
    std::string message = built->message;
    job.report("ready", 1);
    const std::lock_guard lock(mutex_);
    // Clients may have frames of the first picture, and still ask for its basis.
    shown_.push_back(problem_shown_);
    if (shown_.size() > kShownKept) shown_.pop_front();
    picture_.reset();
    compact_of_source_ = built->compact_of_source;
    built_ = std::move(built);
    note_modes();
    whole_ = true;
    return message;
  } catch (...) {
    problem_.reset();
    picture_.reset();
    throw;
  }
}

BodySession::Impl::Built BodySession::Impl::build_model(const JobContext& job) {
  const scene::Scene& scene = *document_.unedited();
  job.report("mesh", 0);
  const MappedBody mapped = map_body(scene);
  const reduced::ModelOptions options = map_model(scene, mapped.body);

  Built built;
  Eigen::MatrixXd animation;
  if (scene.base_motion.size() > 0) animation = map_base_motion(scene, mapped.source_of_compact);
  const auto build = [&](const JobContext& shared) {
    return std::make_shared<const reduced::ReducedModel>(
        reduced::build_model(mapped.body, options, shared.part(0.02, 0.95), animation));
  };
  if (cache_) {
    const std::string key = ModelCache::key(mapped.body, options, animation);
    const auto found = cache_->find_or_build(key, mapped.body.mesh.node_count(), with_picture(job),
                                             build, [&] { begin_picture(mapped, options, job); });
    built.model = found.model;
    built.from_cache = found.is_from_disk;
  } else {
    begin_picture(mapped, options, job);
    built.model = build(with_picture(job));
  }
  std::shared_ptr<const reduced::BaseMotion> base;
  if (scene.base_motion.size() > 0) {
    base = std::make_shared<const reduced::BaseMotion>(
        reduced::base_motion(mapped.body, *built.model, animation, job.part(0.95, 0.98)));
  }
  job.report("geometry", 0.98);
  problem_shown_ = make_shown(mapped, built.model);
  full_body_.reset();
  built.compact_of_source = std::make_shared<const std::vector<int>>(mapped.compact_of_source);
  built.message = built.model->report.message;
  append_clause(built.message, model_notes(scene.model, *built.model));
  built.accuracy = describe_accuracy(built.model->report, scene.model.tolerance);
  modes_ =
      std::min(scene.model.mode_count, built.model->coordinate_count() - built.model->rigid_count);
  built.base = base;
  built.trunk = built.model;
  scene_ = document_.unedited();
  pins_.reset();
  problem_ = make_problem(*scene_, mapped, built.model, std::move(base), modes_);
  return built;
}

std::unique_ptr<LiveProblem> BodySession::Impl::make_problem(
    const scene::Scene& scene, const MappedBody& mapped,
    std::shared_ptr<const reduced::ReducedModel> model,
    std::shared_ptr<const reduced::BaseMotion> base, int modes) const {
  auto keyframes = std::make_unique<KeyframeTargets>(scene, model);
  return std::make_unique<LiveProblem>(
      std::move(model), std::move(base), TargetFrame(scene, mapped, document_.surface_points()),
      std::move(keyframes), ProblemTerms{scene.frame_count, modes, scene.material_optimisation},
      options_.solver);
}

std::shared_ptr<const ShownBasis> BodySession::Impl::make_shown(
    const MappedBody& mapped, const std::shared_ptr<const reduced::ReducedModel>& model) const {
  auto shown = std::make_shared<ShownBasis>();
  shown->basis = {model, &model->basis};
  shown->geometry =
      std::make_shared<const Geometry>(make_geometry(*document_.unedited(), mapped, *model));
  return shown;
}

void BodySession::Impl::solve(const Round& round) {
  const auto known = bring_up_to_date(round);
  const bool is_answered =
      read([&] { return final_ != nullptr && final_->revision == round.revision; });
  if (!known || is_answered) return solve_order(round);
  // Undo and redo return the identical answer, not another one near it.
  solved_ = true;
  auto again = std::make_shared<BodyResult>(*known);
  again->check = Check::kPending;
  again->awaits_modes = is_question(*again);
  again->awaits_starts = is_several_optima_possible(*again) && !is_searched(again->modal);
  publish_of_round(std::move(again), round);
}

/// The solver's inside can no longer be trusted: the next round makes a new one.
void BodySession::Impl::solve_failed(const Round& round, const std::string& reason) {
  const auto [newest, model] = read([this] {
    whole_ = true;
    // A first picture's motion is in other modes.
    const bool is_of_model = newest_ && !newest_->is_first_picture;
    return std::pair{is_of_model ? newest_ : nullptr, built_->model};
  });
  auto result = std::make_shared<BodyResult>(failed_result(
      newest.get(), *model, problem_shown_, document_.unedited()->frame_count, reason));
  publish_of_round(std::move(result), round);
}

/// @returns the answer that is known already; null where there is none
std::shared_ptr<const BodyResult> BodySession::Impl::bring_up_to_date(const Round& round) {
  note_edited(round.order.batch);
  if (round.order.batch.dynamics) dynamics_ = *round.order.batch.dynamics;
  const bool is_moved = round.order.is_with_other_pins || is_with_other_pins(round.order.batch);
  if (is_moved) use_pins(round.order.batch, !round.order.is_whole);
  if (round.order.is_with_fewer_modes) {
    use_fewer_modes(round.order.batch, !round.order.is_whole);
  } else if (!is_moved && round.order.is_whole) {
    problem_->start(round.order.batch);
  } else if (!is_moved) {
    problem_->apply(round.order.batch);
  }
  from_rest_ = round.order.is_whole || round.order.start == BodyOrder::Start::kCold;
  if (round.order.start == BodyOrder::Start::kCold) {
    problem_->solver().set_weight_scale(1);
    // A frozen material is not looked for again.
    if (problem_->variables() != scene::MaterialVariables::kMotion) problem_->reset_material();
    problem_->set_shift(nullptr);
    problem_->solver().cold_start();
    return nullptr;
  }
  if (!std::exchange(has_begun_, true) && document_.unedited()->start) {
    begin_in(*document_.unedited()->start);
    return nullptr;
  }
  auto known = answers_.find(round.order.content);
  if (!known) return nullptr;
  const bool is_of_other_modes = known->mode_changes != mode_changes();
  take_up(*known, is_of_other_modes ? spacetime::Known::kGuess : spacetime::Known::kAnswer);
  return is_of_other_modes ? nullptr : known;
}

/// Parts with a size other than this session's are left out: the start is a guess.
void BodySession::Impl::begin_in(const scene::StartMotion& start) {
  spacetime::Solver& solver = problem_->solver();
  const spacetime::Material& initial = *problem_->initial_material();
  Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(solver.motion().rows(), solver.motion().cols());
  if (start.coordinates.cols() != motion.cols()) return;
  const Eigen::Index rows = std::min(motion.rows(), start.coordinates.rows());
  motion.topRows(rows) = start.coordinates.topRows(rows);
  const Eigen::Index modes = initial.mixing.cols();
  if (start.mixing.rows() == initial.mixing.rows() && start.mixing.cols() == modes &&
      start.stiffness.size() == modes && start.damping.size() == modes) {
    spacetime::Material material{initial.dynamics, start.mixing};
    material.dynamics.stiffness = start.stiffness;
    material.dynamics.damping = start.damping;
    problem_->set_material(std::make_shared<const spacetime::Material>(std::move(material)));
  }
  solver.set_weight_scale(start.weight_scale);
  solver.warm_start(motion, spacetime::Known::kGuess);
  // It is the answer that was wanted: nothing is looked for from rest, as after undo.
  from_rest_ = false;
  tried_ = motion;
}

void BodySession::Impl::solve_order(const Round& round) {
  spacetime::Solver& solver = problem_->solver();
  material_iterations_ = 0;
  spacetime::SolveReport report = solver.correct();
  if (!round.is_cancelled && std::isfinite(report.total_energy)) publish_early(round, report);
  demand_finite(report, solver.motion());
  if (round.is_cancelled) {
    report.status = spacetime::SolveStatus::kCancelled;
    report.message = "cancelled before it was solved";
    if (!stay_with_answer(round, report)) publish_motion(round, report, true);
    return;
  }
  publish_motion(round, report, false);
  leave_rest(round);
}

void BodySession::Impl::solve_rest(const Round& round) {
  spacetime::Solver& solver = problem_->solver();
  std::optional<spacetime::SolveReport> ended = solve_whole(round);
  const scene::Scene& scene = *document_.unedited();
  for (bool raised = false; ended && scene.constraint_tolerance &&
                            ended->status != spacetime::SolveStatus::kCancelled;) {
    const double scale = next_weight_scale(
        solver.weight_scale(), ended->max_constraint_error / scene.length_unit_in_metres,
        *scene.constraint_tolerance, raised);
    if (scale == solver.weight_scale()) break;
    publish_motion(round, *ended, false);
    solver.set_weight_scale(scale);
    ended = solve_whole(round);
  }
  if (!ended) return;
  report_missed_tolerance(scene, solver.weight_scale(), *ended);
  if (stay_with_answer(round, *ended)) return;
  const auto result = publish_motion(round, *ended, true);
  if (result && solved_) answers_.keep(round.order.content, result);
}

std::optional<spacetime::SolveReport> BodySession::Impl::solve_whole(const Round& round) {
  std::optional<spacetime::SolveReport> ended = solve_motion(round);
  if (!ended) return ended;
  ended = polish(round, *ended);
  const bool fits = problem_->variables() != scene::MaterialVariables::kMotion;
  if (ended && !fits) ended = try_from_rest(round, *ended);
  if (!ended) return ended;
  solved_ = ended->status == spacetime::SolveStatus::kConverged;
  if (!fits || ended->status == spacetime::SolveStatus::kCancelled) return ended;
  publish_motion(round, *ended, false);
  return fit_material(round, *ended);
}

std::optional<spacetime::SolveReport> BodySession::Impl::solve_motion(const Round& round,
                                                                      double ceiling) {
  spacetime::Solver& solver = problem_->solver();
  Clock::time_point published = Clock::now();
  bool out_of_date = false;
  const spacetime::SolveReport report =
      solver.solve({round.cancellation, {}}, [&](const spacetime::SolveReport& improved) {
        out_of_date = out_of_date_.requested();
        if (out_of_date) return false;
        const bool is_low = improved.total_energy + problem_->column_energy() <= ceiling;
        if (is_low && Clock::now() - published >= kPublishInterval) {
          publish_motion(round, improved, false);
          published = Clock::now();
        }
        return true;
      });
  demand_finite(report, solver.motion());
  if (out_of_date && report.status == spacetime::SolveStatus::kImproved) return std::nullopt;
  return report;
}

/// For a cold solve that no edit has requested. If it was cancelled or has found nothing better,
/// the existing answer to the revision stays the newest, and the solver continues from it.
bool BodySession::Impl::stay_with_answer(const Round& round, const spacetime::SolveReport& ended) {
  using spacetime::SolveStatus;
  std::shared_ptr<const BodyResult> answer, newest;
  {
    const std::lock_guard lock(mutex_);
    answer = final_;
    newest = newest_;
  }
  if (!answer || answer->revision != round.revision || answer->solve_failed ||
      answer->mode_changes != mode_changes())
    return false;
  const bool cancelled = ended.status == SolveStatus::kCancelled;
  const bool complete = answer->report.status != SolveStatus::kCancelled;
  spacetime::Solver& solver = problem_->solver();
  spacetime::SolveReport whole = ended;
  whole.total_energy += problem_->column_energy();
  // Energies at other weights of the constraints are no comparison; the forces they take are.
  const bool comparable = answer->weight_scale == solver.weight_scale();
  const bool answer_wins = comparable ? solver.prefers(answer->report, whole)
                                      : answer->report.force_energy <= ended.force_energy;
  if (cancelled ? !complete && solver.prefers(whole, answer->report) : !answer_wins) return false;
  take_up(*answer, complete ? spacetime::Known::kAnswer : spacetime::Known::kGuess);
  if (answer == newest) return true;
  auto again = std::make_shared<BodyResult>(*answer);
  if (!cancelled) {
    again->report.message +=
        fmt::format("{}A cold solve ended at the total energy {:.6g}: this answer is kept.",
                    again->report.message.empty() ? "" : " ", whole.total_energy);
  }
  publish_of_round(std::move(again), round);
  return true;
}

std::shared_ptr<const BodyResult> BodySession::Impl::publish_motion(
    const Round& round, const spacetime::SolveReport& report, bool is_final) {
  auto result = result_of_motion(round, report, is_final);
  if (result) publish_of_round(result, round);
  return result;
}

std::shared_ptr<BodyResult> BodySession::Impl::result_of_motion(
    const Round& round, const spacetime::SolveReport& report, bool is_final) {
  auto result = std::make_shared<BodyResult>();
  result->is_final = is_final;
  result->report = report;
  result->modal = problem_->solver().motion();
  fill_material(*problem_->material(), *result);
  result->material = problem_->material();
  if (is_final && is_exact_ && !show_exactly(round, *result)) {
    if (!round.cancellation.requested()) return nullptr;  // an edit was quicker
    is_exact_ = false;
  }
  if (!is_final || !is_exact_) show_by_model(*result);
  result->mode_changes = mode_changes();
  if (is_final) {
    result->is_exact = is_exact_;
    // B is orthonormal: the power of coordinates is that of the shown nodes.
    result->high_frequency_share =
        spacetime::high_frequency_share(result->coordinates.cast<double>());
    result->check = Check::kPending;
    note_reach(*result);
    add_sentence(result->report.message, read([this] { return built_->accuracy; }));
    const KeyframeMiss miss = problem_->keyframe_miss(*result->shown->basis, result->coordinates);
    result->max_keyframe_error = miss.distance;
    if (miss.poor_id != 0) {
      result->report.message += fmt::format(
          "{}keyframe {} in frame {} is missed by {:.2g} of the body's length: its pose moves "
          "fixed nodes, needs candidate modes that do not swing, or contradicts constraints.",
          result->report.message.empty() ? "" : " ", miss.poor_id, miss.poor_frame,
          miss.poor_share);
    }
    result->awaits_modes = is_question(*result);
    result->awaits_starts = is_several_optima_possible(*result) && !is_searched(result->modal);
  }
  return result;
}

void BodySession::Impl::note_reach(BodyResult& result) const {
  const double length = read([this] { return built_->model->length; });
  const auto constraints = problem_->solver().constraints();
  result.out_of_reach = out_of_reach(result.report, constraints, length);
  add_sentence(result.report.message, describe_reach(result.out_of_reach, constraints, length,
                                                     document_.unedited()->length_unit_in_metres));
  for (spacetime::ConstraintMiss& miss : result.out_of_reach) miss.id = constraint_of(miss.id);
}

void BodySession::Impl::publish_of_round(std::shared_ptr<BodyResult> result, const Round& round) {
  result->cold_request = round.order.cold_request;
  publish(std::move(result), round);
}

/// The report is not copied: its energies and errors are of another problem.
BodyResult failed_result(const BodyResult* newest, const reduced::ReducedModel& model,
                         std::shared_ptr<const ShownBasis> shown, int frame_count,
                         const std::string& reason) {
  BodyResult result;
  if (newest != nullptr) {
    result.modal = newest->modal;
    result.mode_changes = newest->mode_changes;
    result.coordinates = newest->coordinates;
    result.shown = newest->shown;
    result.material = newest->material;
    result.initial_material = newest->initial_material;
  } else {
    result.modal.setZero(model.coordinate_count(), frame_count);
    result.coordinates.setZero(shown->basis->cols(), frame_count);
    result.shown = std::move(shown);
  }
  result.is_final = true;
  result.solve_failed = true;
  result.report.status = spacetime::SolveStatus::kStalled;
  result.report.message = fmt::format("the solve failed: {}", reason);
  return result;
}

}  // namespace limber::session
