#include "engine/session/bodies/first_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/session/bodies/geometry.h"

namespace limber::session {
namespace {

constexpr int kMaxSteps = 10;  // of the solver for one picture: the build waits for them

}  // namespace

FirstPicture::FirstPicture(const scene::Scene& scene,
                           std::shared_ptr<const scene::SurfacePoints> points,
                           const MappedBody& mapped, const reduced::ModelOptions& options,
                           const spacetime::SolverOptions& solver, const ModelCache* cache,
                           const JobContext& job) {
  LIMBER_DEMAND(scene.base_motion.size() == 0);
  const auto build = [&](const JobContext& shared) {
    return std::make_shared<const reduced::ReducedModel>(
        reduced::build_first_model(mapped.body, options, shared));
  };
  model_ =
      cache ? cache->first_model(ModelCache::key(mapped.body, options), job, build) : build(job);
  auto shown = std::make_shared<ShownBasis>();
  shown->basis = {model_, &model_->basis};
  shown->geometry = std::make_shared<const Geometry>(make_geometry(scene, mapped, *model_));
  shown_ = std::move(shown);
  const int modes = model_->coordinate_count() - model_->rigid_count;
  problem_ = std::make_unique<LiveProblem>(
      model_, nullptr, TargetFrame(scene, mapped, std::move(points)),
      std::make_unique<KeyframeTargets>(scene, model_),
      ProblemTerms{scene.frame_count, std::min(scene.model.mode_count, modes),
                   scene.material_optimisation},
      solver);
}

void FirstPicture::take(const EditBatch& whole) {
  Eigen::MatrixXd motion;
  if (problem_->started()) motion = problem_->solver().motion();
  problem_->start(whole);
  if (motion.size() > 0) problem_->solver().warm_start(motion, spacetime::Known::kGuess);
}

std::shared_ptr<BodyResult> FirstPicture::correct() {
  return result_of(problem_->solver().correct());
}

std::shared_ptr<BodyResult> FirstPicture::improve(const JobContext& job) {
  int steps = 0;
  return result_of(problem_->solver().solve(
      {job.cancellation, {}}, [&](const spacetime::SolveReport&) { return ++steps < kMaxSteps; }));
}

std::shared_ptr<BodyResult> FirstPicture::result_of(const spacetime::SolveReport& report) {
  auto result = std::make_shared<BodyResult>();
  result->is_first_picture = true;
  result->report = report;
  result->report.status = spacetime::SolveStatus::kImproved;
  result->report.message = fmt::format(
      "First picture, of {} modes, whose own motions it has with a mean shape error of {:.2g} %: "
      "the model is being built, and may move otherwise.",
      model_->coordinate_count() - model_->rigid_count, 100 * model_->report.error_mean);
  result->modal = problem_->solver().motion();
  if (!std::isfinite(report.total_energy) || !result->modal.allFinite())
    throw Error(ErrorCode::kNumerical, "", "the first picture left the finite numbers");
  result->material = problem_->material();
  result->initial_material = problem_->initial_material();
  result->frames_per_second = problem_->frames_per_second();
  result->weight_scale = problem_->solver().weight_scale();
  result->unit_force_energy = spacetime::unit_force_energy(
      *result->material, result->modal, spacetime::beginning_of(problem_->solver().timeline()));
  problem_->model_coordinates(*result->material, result->modal, result->coordinates);
  result->shown = shown_;
  return result;
}

}  // namespace limber::session
