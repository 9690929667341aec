#pragma once

#include <memory>
#include <vector>

#include "engine/session/bodies/live_problem.h"
#include "engine/session/bodies/model_cache.h"
#include "engine/session/bodies/session.h"

namespace limber::session {

/// The first picture of a session, shown while its model is being built: the motion of a coarse
/// model (reduced::build_first_model), solved anew when edits come. Driven by the session's task.
class FirstPicture {
 public:
  /// @param scene  outlives this; without base motion; @param points  of it
  /// @param cache  through which sessions of one body share the model; null: it is of this one
  /// alone
  /// @throws Error as build_first_model()
  FirstPicture(const scene::Scene& scene, std::shared_ptr<const scene::SurfacePoints> points,
               const MappedBody& mapped, const reduced::ModelOptions& options,
               const spacetime::SolverOptions& solver, const ModelCache* cache,
               const JobContext& job);

  [[nodiscard]] const std::shared_ptr<const ShownBasis>& shown() const { return shown_; }

  [[nodiscard]] FirstPictureInfo info() const {
    return {model_->coordinate_count() - model_->rigid_count, model_->report.error_mean};
  }

  /// Gives the solver what the document says. The motion that it has stays its start.
  void take(const EditBatch& whole);
  /// The first correction of the motion; improve() solves on, a few steps. Results are not final
  /// and say that they are of the coarse model.
  [[nodiscard]] std::shared_ptr<BodyResult> correct();
  [[nodiscard]] std::shared_ptr<BodyResult> improve(const JobContext& job);

 private:
  [[nodiscard]] std::shared_ptr<BodyResult> result_of(const spacetime::SolveReport& report);

  std::shared_ptr<const reduced::ReducedModel> model_;
  std::shared_ptr<const ShownBasis> shown_;
  std::unique_ptr<LiveProblem> problem_;
};

}  // namespace limber::session
