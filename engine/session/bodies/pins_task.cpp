#include <utility>

#include "engine/reduced/frame_projection.h"
#include "engine/scene/pinned_motion.h"
#include "engine/session/bodies/impl.h"

// Live edits of animated pins: another base motion under the same constraints. Modes and cubature
// stay. The basis gets the columns that show the base motion. Until the exact frames come, the
// effect of forces on strongly rotated parts is shown through the basis as trained.

namespace limber::session {
namespace {

constexpr double kBaseError = 1e-4;  // of the base motion that its columns leave
constexpr int kMostColumns = 24;

/// @param base  3n x N [m]; empty: none
std::shared_ptr<const reduced::ReducedModel> showing(
    const std::shared_ptr<const reduced::ReducedModel>& trunk, const Eigen::MatrixXd& base) {
  if (base.size() == 0) return trunk;
  const Eigen::MatrixXd columns =
      reduced::project_displacements(base, trunk->basis, {}, {kBaseError, kMostColumns}).columns;
  if (columns.cols() == 0) return trunk;
  return std::make_shared<const reduced::ReducedModel>(reduced::with_columns(*trunk, columns));
}

}  // namespace

bool BodySession::Impl::is_with_other_pins(const EditBatch& batch) const {
  return batch.pins && *batch.pins != pins_;
}

void BodySession::Impl::use_pins(const EditBatch& whole, bool is_warm) {
  const PinPaths& pins = whole.pins.value();
  const auto scene =
      std::make_shared<const scene::Scene>(scene::with_pins(*document_.unedited(), pins));
  provide_full_body();
  auto parts = std::make_shared<BodyParts>(*full_body_->parts());
  parts->base.resize(0, 0);
  if (scene->base_motion.size() > 0)
    parts->base = map_base_motion(*scene, parts->mapped.source_of_compact);
  auto built = std::make_shared<Built>(*read([this] { return built_; }));
  built->model = showing(built->trunk, parts->base);
  built->base.reset();
  if (parts->base.size() > 0) {
    built->base = std::make_shared<const reduced::BaseMotion>(
        reduced::base_motion(parts->mapped.body, *built->model, parts->base));
  }
  auto problem = make_problem(*scene, parts->mapped, built->model, built->base, modes_);
  if (is_warm && problem_->started()) problem->take_fitted(*problem_);
  full_body_ = std::make_shared<FullBody>(parts, built->model);
  set_shown(make_shown(parts->mapped, built->model));
  read([&] { built_ = std::move(built); });
  // Of another problem.
  asked_.reset();
  searched_.resize(0, 0);
  pins_ = pins;
  const auto before = std::exchange(scene_, scene);  // that the old problem reads
  renew_problem(std::move(problem), whole, nullptr, is_warm);
}

void BodySession::Impl::renew_problem(std::unique_ptr<LiveProblem> problem, const EditBatch& whole,
                                      std::shared_ptr<const reduced::FrameShift> shift,
                                      bool is_warm) {
  const auto before = std::exchange(problem_, std::move(problem));
  problem_->start(whole);
  if (!is_warm || !before->started()) return;
  spacetime::Solver& solver = problem_->solver();
  solver.set_weight_scale(before->solver().weight_scale());
  problem_->set_shift(std::move(shift));
  solver.warm_start(before->solver().motion().topRows(solver.motion().rows()),
                    spacetime::Known::kGuess);
  if (options_.exactness == Exactness::kReduced) return;
  provide_full();
  problem_->anchor(spacetime::Known::kGuess);
}

}  // namespace limber::session
