#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/session/geometry.h"
#include "engine/session/material_outcome.h"
#include "engine/session/session_impl.h"
#include "engine/session/weight_scale.h"

namespace limber::session {
namespace {

using Milliseconds = std::chrono::duration<double, std::milli>;
using Seconds = std::chrono::duration<double>;

constexpr Milliseconds kProgressInterval(20);  // between reports of the same stage

void demand_finite(const spacetime::SolveReport& report, const Eigen::MatrixXd& motion) {
  if (!std::isfinite(report.total_energy) || !motion.allFinite()) {
    throw Error(ErrorCode::kNumerical, "", "the solve left the finite numbers");
  }
}

}  // namespace

void Session::Impl::run() {
  if (!task_.begin()) return;
  try {
    if (!problem_ && !build()) return;
    while (const std::optional<Round> round = next_round()) work(*round);
  } catch (...) {  // out of memory between rounds: what was accepted waits for the next call
    std::unique_lock lock(mutex_);
    whole_ = true;
    task_.finish(std::move(lock));
  }
}

bool Session::Impl::build() {
  const auto begin = Clock::now();
  JobContext job{
      read([](const Impl& impl) { return impl.cancellation_; }),
      [this](const std::string& stage, double fraction) { tell_progress(stage, fraction); }};
  try {
    auto built = std::make_shared<Built>(build_model(job));
    built->seconds = Seconds(Clock::now() - begin).count();
    const std::string message = built->message;
    bool open = false;
    {
      const std::lock_guard lock(mutex_);
      built_ = std::move(built);
      whole_ = work_ = true;
      progress_ = {"ready", 1};
      open = !task_.is_closed();
      if (open) {
        state_ = State::kReady;
        message_ = message;
      }
    }
    if (open)
      tell(listener_.get(), [&](Listener& listener) { listener.on_state(State::kReady, message); });
    return true;
  } catch (const Error& error) {
    build_failed(error);
  } catch (const std::exception& error) {
    build_failed(Error(ErrorCode::kInternal, "", error.what()));
  } catch (...) {
    build_failed(Error(ErrorCode::kInternal, "", "unknown exception"));
  }
  return false;
}

Session::Impl::Built Session::Impl::build_model(const JobContext& job) {
  const scene::Scene& scene = *document_.unedited();
  job.report("mesh", 0);
  const MappedBody mapped = map_body(scene);
  const reduced::ModelOptions options = map_model(scene, mapped.body);

  Built built;
  Eigen::MatrixXd animation;
  if (scene.base_motion.size() > 0) animation = map_base_motion(scene, mapped.source_of_compact);
  const std::string key = cache_ ? ModelCache::key(mapped.body, options, animation) : std::string();
  if (cache_) built.model = cache_->load(key);
  if (built.model && built.model->node_count != mapped.body.mesh.node_count()) built.model.reset();
  built.from_cache = built.model != nullptr;
  if (!built.model) {
    built.model = std::make_shared<const reduced::ReducedModel>(
        reduced::build_model(mapped.body, options, job.part(0.02, 0.95), animation));
    if (cache_) cache_->store(key, *built.model);
  }
  std::shared_ptr<const reduced::BaseMotion> base;
  if (scene.base_motion.size() > 0) {
    base = std::make_shared<const reduced::BaseMotion>(
        reduced::base_motion(mapped.body, *built.model, animation, job.part(0.95, 0.98)));
  }
  job.report("geometry", 0.98);
  built.geometry = make_geometry(scene, mapped, *built.model);
  built.compact_of_source = mapped.compact_of_source;
  built.message = built.model->report.message;
  const std::string notes = model_notes(scene.model, *built.model);
  if (!built.message.empty() && !notes.empty()) built.message += "; ";
  built.message += notes;
  built.accuracy = describe_accuracy(built.model->report, scene.model.tolerance);
  problem_ = std::make_unique<LiveProblem>(
      built.model, base, TargetFrame(scene, mapped),
      std::make_unique<KeyframeTargets>(scene, built.model),
      ProblemTerms{scene.frame_count, scene.model.mode_count, scene.material_optimisation},
      options_.solver);
  return built;
}

void Session::Impl::build_failed(const Error& error) {
  problem_.reset();
  std::string message = error.what();
  if (!error.field().empty()) message = fmt::format("{}: {}", error.field(), message);
  std::unique_lock lock(mutex_);
  if (!task_.is_closed()) {
    state_ = State::kFailed;
    message_ = message;
    lock.unlock();
    tell(listener_.get(), [&](Listener& listener) { listener.on_state(State::kFailed, message); });
    lock.lock();
  }
  const bool again =
      state_ == State::kBuilding && !task_.is_closed();  // the listener asked for another try
  task_.finish(std::move(lock));
  if (again) post(std::unique_lock(mutex_));
}

std::optional<Session::Impl::Round> Session::Impl::next_round() {
  std::unique_lock lock(mutex_);
  while (!task_.is_closed() && !work_ && (amendment_ || is_check_due())) {
    if (amendment_) {
      const Amendment amendment = *std::exchange(amendment_, std::nullopt);
      const bool is_newest = amendment.result == newest_;
      lock.unlock();
      if (is_newest) amend(amendment);
    } else {
      begin_check(std::move(lock));
    }
    lock = std::unique_lock(mutex_);
  }
  if (task_.is_closed() || !work_) {
    skip_solve_ = false;
    task_.finish(std::move(lock));
    return std::nullopt;
  }
  Round round;
  round.revision = document_.revision();
  round.content = document_.content();
  round.edited_at = edited_at_;
  round.is_whole = whole_;
  round.batch = whole_ ? whole_batch(document_) : batch_of(document_, touched_);
  round.start = cold_ ? Round::Start::kCold : Round::Start::kWarm;
  if (cold_) cold_taken_ = cold_asked_;
  round.cold_request = cold_taken_;
  round.depth = skip_solve_ ? Round::Depth::kCorrectOnly : Round::Depth::kSolve;
  cancellation_ = round.cancellation;
  touched_ = {};
  work_ = whole_ = cold_ = skip_solve_ = false;
  interrupt_.store(false, std::memory_order_relaxed);
  return round;
}

void Session::Impl::work(const Round& round) {
  std::string reason;
  try {
    bring_up_to_date(round);
    solve(round);
    return;
  } catch (const std::exception& error) {
    reason = error.what();
  } catch (...) {
    reason = "unknown exception";
  }
  // The solver's inside can no longer be trusted: the next round makes a new one.
  {
    const std::lock_guard lock(mutex_);
    whole_ = true;
  }
  try {
    publish_failure(round, reason);
  } catch (...) {
    // Out of memory; the next edit tries again.
  }
}

void Session::Impl::bring_up_to_date(const Round& round) {
  if (round.is_whole) {
    problem_->start(round.batch);
  } else {
    problem_->apply(round.batch);
  }
  if (round.start == Round::Start::kCold) {
    problem_->solver().set_weight_scale(1);
    // A frozen material is not looked for again.
    if (problem_->variables() != scene::MaterialVariables::kMotion) problem_->reset_material();
    return problem_->solver().cold_start();
  }
  const auto known = answers_.find(round.content);
  if (!known) return;
  problem_->set_material(known->material);
  start_of_fit_ = known->start_of_fit;
  problem_->solver().set_weight_scale(known->weight_scale);
  problem_->solver().warm_start(known->modal, spacetime::Known::kAnswer);
}

void Session::Impl::solve(const Round& round) {
  spacetime::Solver& solver = problem_->solver();
  material_iterations_ = 0;
  spacetime::SolveReport report = solver.correct();
  demand_finite(report, solver.motion());
  if (round.depth == Round::Depth::kCorrectOnly) {
    report.status = spacetime::SolveStatus::kCancelled;
    report.message = "cancelled before it was solved";
    if (!stay_with_answer(round, report)) publish(round, report, true);
    return;
  }
  publish(round, report, false);

  std::optional<spacetime::SolveReport> ended = solve_whole(round);
  const scene::Scene& scene = *document_.unedited();
  for (bool raised = false; ended && scene.constraint_tolerance &&
                            ended->status != spacetime::SolveStatus::kCancelled;) {
    const double scale = next_weight_scale(
        solver.weight_scale(), ended->max_constraint_error / scene.length_unit_in_metres,
        *scene.constraint_tolerance, raised);
    if (scale == solver.weight_scale()) break;
    publish(round, *ended, false);
    solver.set_weight_scale(scale);
    ended = solve_whole(round);
  }
  if (!ended) return;
  tell_tolerance(scene, solver.weight_scale(), *ended);
  if (stay_with_answer(round, *ended)) return;
  const auto result = publish(round, *ended, true);
  if (solved_) answers_.keep(round.content, result);
}

std::optional<spacetime::SolveReport> Session::Impl::solve_whole(const Round& round) {
  std::optional<spacetime::SolveReport> ended = solve_motion(round);
  if (!ended) return ended;
  solved_ = ended->status == spacetime::SolveStatus::kConverged;
  if (problem_->variables() == scene::MaterialVariables::kMotion ||
      ended->status == spacetime::SolveStatus::kCancelled)
    return ended;
  publish(round, *ended, false);
  return fit_material(round, *ended);
}

std::optional<spacetime::SolveReport> Session::Impl::solve_motion(const Round& round,
                                                                  double ceiling) {
  spacetime::Solver& solver = problem_->solver();
  Clock::time_point published = Clock::now();
  bool out_of_date = false;
  const spacetime::SolveReport report =
      solver.solve({round.cancellation, {}}, [&](const spacetime::SolveReport& improved) {
        out_of_date = interrupt_.load(std::memory_order_relaxed);
        if (out_of_date) return false;
        const bool is_low = improved.total_energy + problem_->column_energy() <= ceiling;
        if (is_low && Clock::now() - published >= kPublishInterval) {
          publish(round, improved, false);
          published = Clock::now();
        }
        return true;
      });
  demand_finite(report, solver.motion());
  if (out_of_date && report.status == spacetime::SolveStatus::kImproved) return std::nullopt;
  return report;
}

/// Of a solve that no edit had asked for, a cold one: where it was cancelled or has found nothing
/// better, the answer that the revision has already stays the newest, and the solver goes on from
/// it.
bool Session::Impl::stay_with_answer(const Round& round, const spacetime::SolveReport& ended) {
  using spacetime::SolveStatus;
  std::shared_ptr<const Result> answer, newest;
  {
    const std::lock_guard lock(mutex_);
    answer = converged_;
    newest = newest_;
  }
  if (!answer || answer->revision != round.revision || answer->solve_failed) return false;
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
  problem_->set_material(answer->material);
  start_of_fit_ = answer->start_of_fit;
  solver.set_weight_scale(answer->weight_scale);
  solver.warm_start(answer->modal, complete ? spacetime::Known::kAnswer : spacetime::Known::kGuess);
  if (answer == newest) return true;
  auto again = std::make_shared<Result>(*answer);
  if (!cancelled) {
    again->report.message +=
        fmt::format("{}A cold solve ended at the total energy {:.6g}: this answer is kept.",
                    again->report.message.empty() ? "" : " ", whole.total_energy);
  }
  hand_out(std::move(again), round);
  return true;
}

std::shared_ptr<const Result> Session::Impl::publish(const Round& round,
                                                     const spacetime::SolveReport& report,
                                                     bool final) {
  auto result = std::make_shared<Result>();
  result->converged = final;
  result->since_edit_ms = round.since_edit_ms();
  result->report = report;
  result->modal = problem_->solver().motion();
  fill_material(*problem_->material(), *result);
  result->material = problem_->material();
  if (final) {
    result->high_frequency_share = problem_->high_frequency_share(*result->material, result->modal);
    result->check = Check::kPending;
    add_sentence(result->report.message,
                 read([](const Impl& impl) { return impl.built_->accuracy; }));
    const KeyframeMiss miss = problem_->keyframe_miss(result->coordinates);
    result->max_keyframe_error = miss.distance;
    if (miss.poor_id != 0) {
      result->report.message += fmt::format(
          "{}keyframe {} in frame {} is missed by {:.2g} of the body's length: its pose is beyond "
          "the model's shapes (few modes, or twists near full turns).",
          result->report.message.empty() ? "" : " ", miss.poor_id, miss.poor_frame,
          miss.poor_share);
    }
  }
  hand_out(result, round);
  return result;
}

void Session::Impl::publish_failure(const Round& round, const std::string& reason) {
  const auto newest = read([](const Impl& impl) { return impl.newest_; });
  const auto model = read([](const Impl& impl) { return impl.built_->model; });
  auto result = std::make_shared<Result>(
      failed_result(newest.get(), *model, document_.unedited()->frame_count, reason));
  result->since_edit_ms = round.since_edit_ms();
  hand_out(std::move(result), round);
}

void Session::Impl::hand_out(std::shared_ptr<Result> result, const Round& round) {
  result->revision = round.revision;
  result->cold_request = round.cold_request;
  hand_out(std::move(result));
}

void Session::Impl::hand_out(std::shared_ptr<Result> result) {
  std::shared_ptr<const Result> older, older_final;  // freed without the lock: they may be large
  {
    const std::lock_guard lock(mutex_);
    if (task_.is_closed()) return;
    result->sequence = ++sequence_;
    older = std::exchange(newest_, result);
    if (result->converged) older_final = std::exchange(converged_, result);
  }
  tell(listener_.get(), [&](Listener& listener) { listener.on_result(result); });
}

void Session::Impl::tell_progress(const std::string& stage, double fraction) {
  const Clock::time_point now = Clock::now();
  const Progress progress{stage, std::clamp(fraction, 0.0, 1.0)};
  {
    const std::lock_guard lock(mutex_);
    const bool same_stage = progress_.stage == stage;
    progress_ = progress;
    if (same_stage && now - progress_told_ < kProgressInterval) return;
  }
  progress_told_ = now;
  tell(listener_.get(), [&](Listener& listener) { listener.on_progress(progress); });
}

/// The report is not copied: its energies and errors are of another problem.
Result failed_result(const Result* newest, const reduced::ReducedModel& model, int frame_count,
                     const std::string& reason) {
  Result result;
  if (newest != nullptr) {
    result.modal = newest->modal;
    result.coordinates = newest->coordinates;
    result.material = newest->material;
    result.initial_material = newest->initial_material;
  } else {
    result.modal.setZero(model.coordinate_count(), frame_count);
    result.coordinates.setZero(model.basis_size(), frame_count);
  }
  result.converged = true;
  result.solve_failed = true;
  result.report.status = spacetime::SolveStatus::kStalled;
  result.report.message = fmt::format("the solve failed: {}", reason);
  return result;
}

}  // namespace limber::session
