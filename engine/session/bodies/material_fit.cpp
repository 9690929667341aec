#include <algorithm>
#include <limits>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/session/bodies/impl.h"
#include "engine/session/bodies/material_outcome.h"

namespace limber::session {
namespace {

using spacetime::MaterialReport;
using spacetime::SolveStatus;

// Steps are measured at so many nodes, those of a limited fit at fewer (2 to 4 ms for 380 frames),
// which leaves this share for the others.
constexpr int kSampledNodes = 512, kNodesInSteps = 128;
constexpr double kLeftForOthers = 0.02;
// Bodies that float need less force with steps up to 1.3 times as long, which is reported. Beyond
// this factor, motions throw parts about (7 to 10 times on the flower with both ends free).
constexpr double kMuchFarther = 1.5;

}  // namespace

void report_outcome(const MaterialReport& material, spacetime::SolveReport& report) {
  report.iterations += material.iterations;
  if (material.message.empty()) return;
  append_clause(report.message, material.message);
  if (report.status == SolveStatus::kConverged || material.status == SolveStatus::kCancelled)
    report.status = material.status;
}

std::optional<MaterialReport> BodySession::Impl::optimise_material(const Round& round, Steps steps,
                                                                   double most) {
  std::optional<spacetime::MaterialSolver> solver;
  const Eigen::MatrixXd rows = rows_of_some_nodes(built_->model->basis, kNodesInSteps);
  const auto size = [&](const Eigen::MatrixXd& mixing, const Eigen::MatrixXd& motion) {
    Eigen::MatrixXf coordinates;
    problem_->model_coordinates({{}, mixing}, motion, coordinates);
    return largest_frame_step(rows, coordinates, {});
  };
  try {
    spacetime::MaterialOptions::MotionLimit limit;
    if (steps == Steps::kLimited) limit = {size, (1 - kLeftForOthers) * most};
    solver.emplace(problem_->material_solver(std::move(limit)));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kLimitExceeded && error.code() != ErrorCode::kUnsupported) throw;
    MaterialReport refused;
    refused.status = SolveStatus::kStalled;
    refused.message = error.what();
    return refused;
  }
  Clock::time_point published;  // long ago: the first step is published at once
  bool out_of_date = false;
  const MaterialReport report =
      solver->solve({round.cancellation, {}}, [&](const MaterialReport& improved) {
        out_of_date = out_of_date_.requested();
        if (out_of_date) return false;
        if (improved.below_start && Clock::now() - published >= kPublishInterval &&
            size(solver->material().mixing, solver->motion()) <= most) {
          publish_material(round, improved, *solver);
          published = Clock::now();
        }
        return true;
      });
  material_iterations_ = report.iterations;
  // The next edit's optimisation continues from this point.
  if (out_of_date && size(solver->material().mixing, solver->motion()) > kMuchFarther * most)
    return std::nullopt;
  if (report.below_start) {
    problem_->set_material(std::make_shared<const spacetime::Material>(solver->material()));
    problem_->solver().warm_start(solver->motion(), spacetime::Known::kAnswer);
  } else if (out_of_date) {
    problem_->keep_unfinished(*solver, report.iterations);
  }
  if (out_of_date) return std::nullopt;
  return report;
}

std::optional<spacetime::SolveReport> BodySession::Impl::fit_material(
    const Round& round, const spacetime::SolveReport& start) {
  const Eigen::MatrixXd rows = rows_of_some_nodes(built_->model->basis, kSampledNodes);
  const Fit before{problem_->material(), problem_->solver().motion(), is_exact_};
  const std::optional<double> first = largest_step_now(round);
  if (!first) return std::nullopt;
  const bool is_initial = before.material == problem_->initial_material();
  // A material that was fitted to other targets may throw the body about for these: it is fitted
  // anew then, from the motion with forces alone.
  if (!is_initial && start_of_fit_ && !problem_->allows_high_frequencies() &&
      *first > kMuchFarther * largest_frame_step(rows, *start_of_fit_, {})) {
    problem_->reset_material();
    problem_->set_shift(nullptr);
    problem_->solver().cold_start();
    std::optional<spacetime::SolveReport> again = solve_motion(round);
    if (again) again = polish(round, *again);
    if (!again || again->status == SolveStatus::kCancelled) return again;
    publish_motion(round, *again, false);
    return fit_material(round, *again);
  }
  double most = *first;
  if (is_initial)
    start_of_fit_ = std::make_shared<const Eigen::MatrixXf>(coordinates_now());
  else if (start_of_fit_)  // the fit began with an earlier motion, and may have lengthened its
                           // steps
    most = std::max(most / kMuchFarther, largest_frame_step(rows, *start_of_fit_, {}));
  if (problem_->allows_high_frequencies()) most = std::numeric_limits<double>::infinity();
  const double energy = start.total_energy + problem_->column_energy();
  for (Steps steps = Steps::kFree;; steps = Steps::kLimited) {
    std::optional<MaterialReport> fitted = optimise_material(round, steps, most);
    if (!fitted) return std::nullopt;
    const bool was_cancelled = fitted->status == SolveStatus::kCancelled;
    is_exact_ = false;
    if (steps == Steps::kFree && !was_cancelled &&
        largest_frame_step(rows, coordinates_now(), {}) > kMuchFarther * most) {
      restore(before);
      continue;
    }
    std::optional<spacetime::SolveReport> ended = solve_motion(round, energy);
    if (ended) ended = polish(round, *ended, energy);
    if (!ended) return ended;
    const std::optional<double> farthest = largest_step_now(round);
    if (!farthest) return std::nullopt;
    // Exact constraints are only approached while the material is fitted: meeting them may cost
    // more.
    const double exact_limit = std::max(
        options_.solver.constraint_tolerance * built_->model->length, 1.1 * ended->exact_error());
    const bool is_higher = ended->total_energy + problem_->column_energy() > energy &&
                           start.exact_error() <= exact_limit;
    const bool is_cancelled = was_cancelled || ended->status == SolveStatus::kCancelled;
    const bool goes_far = !is_higher && *farthest > kMuchFarther * most;
    if (goes_far && steps == Steps::kFree && !is_cancelled) {
      restore(before);
      continue;
    }
    if (is_higher || goes_far) {
      restore(before);
      *ended = start;
    }
    if (is_cancelled) {
      fitted->status = SolveStatus::kCancelled;
      fitted->message = "the material's optimisation was cancelled";
    } else if (goes_far) {
      fitted->status = SolveStatus::kStalled;
      fitted->message =
          "every better material that was found moves nodes much farther from one frame to the "
          "next than they moved before";
    } else if (steps == Steps::kLimited && fitted->status == SolveStatus::kStalled) {
      fitted->message =
          "materials with less energy move nodes farther from one frame to the next than they "
          "moved before";
    }
    solved_ = ended->status == SolveStatus::kConverged && !is_cancelled;
    report_outcome(*fitted, *ended);
    return ended;
  }
}

void BodySession::Impl::restore(const Fit& fit) {
  problem_->set_material(fit.material);
  problem_->solver().warm_start(fit.motion, spacetime::Known::kAnswer);
  is_exact_ = fit.is_exact;
  if (is_exact_) problem_->anchor(spacetime::Known::kAnswer);
}

std::optional<double> BodySession::Impl::largest_step_now(const Round& round) {
  if (!is_exact_) {
    const Eigen::MatrixXd rows = rows_of_some_nodes(built_->model->basis, kSampledNodes);
    return largest_frame_step(rows, coordinates_now(), {});
  }
  const std::optional<Eigen::MatrixXf> frames =
      frames_in_full(round, *problem_->material(), problem_->solver().motion(), coordinates_now());
  if (!frames) return std::nullopt;
  return largest_frame_step(rows_of_some_nodes(*problem_shown_->basis, kSampledNodes), *frames, {});
}

Eigen::MatrixXf BodySession::Impl::coordinates_now() const {
  Eigen::MatrixXf coordinates;
  problem_->model_coordinates(*problem_->material(), problem_->solver().motion(), coordinates);
  return coordinates;
}

void BodySession::Impl::publish_material(const Round& round, const MaterialReport& report,
                                         const spacetime::MaterialSolver& solver) {
  auto result = std::make_shared<BodyResult>();
  result->report.status = SolveStatus::kImproved;
  result->report.iterations = report.iterations;
  result->report.force_energy = report.force_energy;
  result->report.constraint_energy = report.constraint_energy;
  result->report.total_energy = report.force_energy + report.constraint_energy;
  result->report.gradient = 1;  // not determined during the optimisation
  static_cast<spacetime::ConstraintErrors&>(result->report) = report;
  result->modal = solver.motion();
  result->material = std::make_shared<const spacetime::Material>(solver.material());
  material_iterations_ = report.iterations;
  fill_material(*result->material, *result);
  show_by_model(*result);
  publish_of_round(std::move(result), round);
}

void BodySession::Impl::fill_material(const spacetime::Material& material,
                                      BodyResult& result) const {
  result.initial_material = problem_->initial_material();
  if (problem_->variables() != scene::MaterialVariables::kMotion &&
      problem_->material() != result.initial_material)
    result.start_of_fit = start_of_fit_;
  result.frames_per_second = problem_->frames_per_second();
  result.weight_scale = problem_->solver().weight_scale();
  result.material_iterations = material_iterations_;
  result.column_energy = document_.unedited()->material_optimisation.column_weight *
                         spacetime::column_energy(material.mixing);
  result.report.total_energy += result.column_energy;
  result.unit_force_energy = spacetime::unit_force_energy(
      material, result.modal, spacetime::beginning_of(problem_->solver().timeline()));
}

void BodySession::Impl::show_by_model(BodyResult& result) const {
  problem_->coordinates(*result.material, result.modal,
                        {result.first_frame, static_cast<int>(result.modal.cols())},
                        result.coordinates);
  result.shown = problem_shown_;
  const Eigen::Index size = result.shown->basis->cols(), before = result.coordinates.rows();
  if (before < size) {  // the model's own, if its error is not known
    result.coordinates.conservativeResize(size, Eigen::NoChange);
    result.coordinates.bottomRows(size - before).setZero();
  }
}

}  // namespace limber::session
