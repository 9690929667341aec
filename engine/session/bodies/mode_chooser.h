#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/reduced_model.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/full_body.h"
#include "engine/session/bodies/mode_choice.h"
#include "engine/session/bodies/model_cache.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

struct BodyResult;

/// The problem of an exact answer, without its modes: the same for any number of them.
struct ModeProblem {
  /// With their sites; the id `site` means nothing.
  std::vector<std::pair<spacetime::PositionConstraint, std::shared_ptr<const reduced::Site>>>
      constraints;
  spacetime::Timeline timeline;
  double weight_scale = 1;
  scene::Dynamics dynamics;
  Eigen::MatrixXd load;  // of the base motion on the present modes, r x N; empty: none
};

/// Whether r modes are enough for an exact answer.
struct ModeRequest {
  std::shared_ptr<const BodyResult> result;  // z in the first r coordinates of the model
  std::shared_ptr<const reduced::ReducedModel> model;
  std::shared_ptr<const BodyParts> body;
  ModeProblem problem;
  int modes = 0;  // r, elastic
};

/// The number r, with all that the session needs to continue with it.
struct ModeFinding {
  ModeChoice choice;
  /// The model of the request, or where it has too few modes another one.
  std::shared_ptr<const reduced::ReducedModel> model;
  std::shared_ptr<const reduced::BaseMotion> base;  // of that other one, where the scene has one
  Eigen::MatrixXd motion;    // z with r modes of `model`, an optimum of the full map
  Eigen::MatrixXd transfer;  // from coordinates of the request's motion to those of `motion`
  double build_s = 0;        // of another model
  bool from_cache = false;
};

/// z' = T z with W-hat' z' ~ W-hat z: T of two sets of modes of one body, least squares over the
/// elastic ones. @returns R' x R
[[nodiscard]] Eigen::MatrixXd mode_transfer(const reduced::ReducedModel& from,
                                            const reduced::ReducedModel& to);

/// Why the optimum with more modes is not shown in place of the one before; empty: it is.
[[nodiscard]] std::string reason_against_more_modes(const spacetime::SolveReport& before,
                                                    const spacetime::SolveReport& with_more);

/// Compares optimal energies of one session's scene with more and fewer modes. The optima are those
/// of the full rotation-strain map, which needs no reduced model: one is built only for the r that
/// was chosen. For one thread at a time.
class ModeChooser {
 public:
  /// @param cache  of models, or null
  ModeChooser(std::shared_ptr<const scene::Scene> scene, ModeChoiceOptions options,
              spacetime::SolverOptions solver, std::shared_ptr<const ModelCache> cache);

  /// @throws Error{kCancelled}, and as reduced::build_model()
  [[nodiscard]] ModeFinding choose(const ModeRequest& request, const JobContext& job);

 private:
  struct Optimum;
  using SharedModel = std::shared_ptr<const reduced::ReducedModel>;

  [[nodiscard]] SharedModel modes_alone(const ModeRequest& request, int modes,
                                        const JobContext& job) const;
  /// From a start in the first coordinates of `model`.
  [[nodiscard]] Optimum optimum(const ModeRequest& request, const SharedModel& model, int modes,
                                const Eigen::MatrixXd& start, const JobContext& job) const;
  void grow(const ModeRequest& request, Optimum& now, ModeChoice& choice,
            const JobContext& job) const;
  void shrink(const ModeRequest& request, Optimum& now, ModeChoice& choice,
              const JobContext& job) const;
  void build(const ModeRequest& request, ModeFinding& finding, const JobContext& job) const;

  std::shared_ptr<const scene::Scene> scene_;
  ModeChoiceOptions options_;
  spacetime::SolverOptions solver_;
  std::shared_ptr<const ModelCache> cache_;
};

}  // namespace limber::session
