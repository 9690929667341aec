#include <chrono>
#include <thread>
#include <utility>

#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/impl.h"

// The exact step: behind the reduced model's answer, the optimum with the full rotation-strain map
// at constrained nodes, and its frames by full reconstruction.

namespace limber::session {
namespace {

using spacetime::SolveStatus;

// Shapes of exact results are off by less than this share of the scene's tolerance, or this.
// Edits of a drag are 16 ms apart.
constexpr std::chrono::milliseconds kPause{40}, kLook{2};
constexpr double kShapeShare = 0.1, kLargestShapeError = 1e-3;

}  // namespace

void BodySession::Impl::use_level(reduced::LayeredKinematics::Level level) {
  if (level == reduced::LayeredKinematics::Level::kFull) {
    if (!full_body_) {
      full_body_ =
          std::make_unique<FullBody>(*document_.unedited(), read([this] { return built_->model; }));
    }
    problem_->provide_full([this] { return full_body_->make_kinematics(); });
  }
  problem_->use(level);
}

/// A drag's next edit would interrupt the step and have to wait until that has noticed: after one
/// that was interrupted, the next waits for a pause.
bool BodySession::Impl::is_quiet() {
  if (!was_interrupted_) return true;
  for (auto waited = Clock::duration(0); waited < kPause; waited += kLook) {
    if (interrupt_.load(std::memory_order_relaxed)) return false;
    std::this_thread::sleep_for(kLook);
  }
  return !interrupt_.load(std::memory_order_relaxed);
}

std::optional<spacetime::SolveReport> BodySession::Impl::polish(
    const Round& round, const spacetime::SolveReport& start) {
  using Level = reduced::LayeredKinematics::Level;
  is_exact_ = false;
  if (options_.exactness == Exactness::kReduced || start.status == SolveStatus::kCancelled ||
      interrupt_.load(std::memory_order_relaxed))
    return start;
  publish_motion(round, start, false);
  if (!is_quiet()) return std::nullopt;
  spacetime::Solver& solver = problem_->solver();
  const Eigen::MatrixXd before = solver.motion();
  bool out_of_date = false;
  spacetime::SolveReport report;
  try {
    use_level(Level::kFull);
    report = problem_->solver().solve({round.cancellation, {}}, [&](const auto& /*improved*/) {
      out_of_date = interrupt_.load(std::memory_order_relaxed);
      return !out_of_date;
    });
    use_level(Level::kReduced);
  } catch (...) {
    problem_->use(Level::kReduced);
    throw;
  }
  was_interrupted_ = out_of_date && report.status == SolveStatus::kImproved;
  if (was_interrupted_) return std::nullopt;
  if (report.status ==
      SolveStatus::kCancelled) {  // what there was is an answer, if not the exact one
    solver.warm_start(before, spacetime::Known::kAnswer);
    spacetime::SolveReport cancelled = start;
    cancelled.status = SolveStatus::kCancelled;
    cancelled.message = report.message;
    return cancelled;
  }
  is_exact_ = true;
  report.iterations += start.iterations;
  if (problem_->variables() == scene::MaterialVariables::kMotion) {
    solved_ = report.status == SolveStatus::kConverged;
    return report;
  }
  // How the fit of the material ended is what the status says.
  report.status = start.status;
  report.message = start.message;
  return report;
}

bool BodySession::Impl::show_exactly(const Round& round, BodyResult& result) {
  const JobContext job{round.cancellation, [this](const auto& /*stage*/, double /*fraction*/) {
                         if (interrupt_.load(std::memory_order_relaxed))
                           throw Error(ErrorCode::kCancelled, "", "an edit was quicker");
                       }};
  ShowOptions options;
  options.tolerance =
      std::min(kLargestShapeError, kShapeShare * document_.unedited()->model.tolerance);
  const std::shared_ptr<const ShownBasis> before = problem_shown_;
  Eigen::MatrixXf reduced;
  problem_->model_coordinates(*result.material, result.modal, reduced);
  FullBody::Shown shown;
  try {
    shown = full_body_->show(before->basis, result.material->mixing * result.modal, reduced,
                             problem_->held_frames(), options, job);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
    return false;
  }
  if (shown.basis != before->basis) {
    auto next = std::make_shared<ShownBasis>();
    next->basis = shown.basis;
    Geometry geometry =
        with_basis(*before->geometry, *document_.unedited(),
                   read([this] { return built_; })->compact_of_source, *shown.basis);
    const Eigen::Index columns = before->basis->cols();
    geometry.extended_hash.clear();
    if (geometry.basis.cols() > columns &&
        geometry.basis.leftCols(columns) == before->geometry->basis) {
      geometry.extended_hash = before->geometry->basis_hash;
      geometry.extended_columns = static_cast<int>(columns);
    }
    next->geometry = std::make_shared<const Geometry>(std::move(geometry));
    set_shown(std::move(next));
  }
  result.coordinates = std::move(shown.coordinates);
  result.shown = problem_shown_;
  shift_frames(reduced, result);
  return true;
}

/// From now on frames of the model are shown where this result has them, as far as its motion goes.
void BodySession::Impl::shift_frames(const Eigen::MatrixXf& reduced, const BodyResult& result) {
  auto shift = std::make_shared<reduced::FrameShift>();
  shift->basis = result.shown->basis;
  shift->shift = result.coordinates;
  shift->shift.topRows(reduced.rows()) -= reduced;
  problem_->set_shift(std::move(shift));
}

void BodySession::Impl::set_shown(std::shared_ptr<const ShownBasis> shown) {
  problem_shown_ = shown;
  const std::lock_guard lock(mutex_);
  shown_.push_back(std::move(shown));
  if (shown_.size() > kShownKept) shown_.pop_front();
}

/// The frames of an answer that is taken up again.
void BodySession::Impl::show_again(const BodyResult& answer) {
  if (!answer.is_exact) return problem_->set_shift(nullptr);
  Eigen::MatrixXf reduced;
  problem_->model_coordinates(*answer.material, answer.modal, reduced);
  if (answer.shown != problem_shown_) set_shown(answer.shown);
  shift_frames(reduced, answer);
}

}  // namespace limber::session
