#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <mutex>
#include <utility>

#include "engine/base/clauses.h"
#include "engine/base/given_up.h"
#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/impl.h"

// The exact step: behind the reduced model's answer, the optimum with the full rotation-strain map
// at constrained nodes, and its frames by full reconstruction.

namespace limber::session {
namespace {

using spacetime::SolveStatus;

// Edits of a drag are 16 ms apart.
constexpr std::chrono::milliseconds kPause{40};
// Shapes of exact results are off by less than this share of the scene's tolerance, or this.
constexpr double kShapeShare = 0.1, kLargestShapeError = 1e-3;
// Share of a motion by which it may have changed since the optimum from rest was compared with it.
// Not known to be tuned: it bounds the cost, a second solve, to drags that go far.
constexpr double kNear = 0.5;

/// As long as it exists, the full map abandons work that is out of date.
class Heeding {
 public:
  Heeding(LiveProblem& problem, const Cancellation& cancellation) : problem_(problem) {
    problem_.heed(cancellation);
  }
  ~Heeding() { problem_.heed(never_); }
  Heeding(const Heeding&) = delete;
  Heeding& operator=(const Heeding&) = delete;

 private:
  LiveProblem& problem_;
  const Cancellation never_;
};

}  // namespace

void BodySession::Impl::provide_full_body() {
  if (full_body_) return;
  full_body_ = std::make_shared<FullBody>(std::make_shared<const BodyParts>(*scene_),
                                          read([this] { return built_->model; }));
}

void BodySession::Impl::provide_full() {
  provide_full_body();
  problem_->provide_full([this] { return full_body_->make_kinematics(); });
}

/// A drag's next edit would interrupt the step and have to wait until that has noticed: after one
/// that was interrupted, the next waits for a pause.
bool BodySession::Impl::is_quiet() {
  if (!was_interrupted_) return true;
  std::unique_lock lock(mutex_);
  return !gone_out_of_date_.wait_for(lock, kPause, [this] { return out_of_date_.requested(); });
}

std::optional<spacetime::SolveReport> BodySession::Impl::polish(const Round& round,
                                                                const spacetime::SolveReport& start,
                                                                double ceiling) {
  using Level = reduced::LayeredKinematics::Level;
  is_exact_ = false;
  if (options_.exactness == Exactness::kReduced || start.status == SolveStatus::kCancelled ||
      out_of_date_.requested())
    return start;
  if (start.total_energy + problem_->column_energy() <= ceiling)
    publish_motion(round, start, false);
  if (!is_quiet()) return std::nullopt;
  spacetime::Solver& solver = problem_->solver();
  const Eigen::MatrixXd before = solver.motion();
  spacetime::SolveReport report;
  provide_full();
  try {
    was_interrupted_ = is_given_up([&] {
      const Heeding heeding(*problem_, out_of_date_);
      problem_->use(Level::kFull);
      report = solver.solve({round.cancellation, {}},
                            [&](const auto& /*improved*/) { return !out_of_date_.requested(); });
      if (report.status != SolveStatus::kImproved) problem_->anchor(spacetime::Known::kAnswer);
    });
  } catch (...) {
    problem_->use(Level::kReduced);
    throw;
  }
  problem_->use(Level::kReduced);
  was_interrupted_ = was_interrupted_ || report.status == SolveStatus::kImproved;
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
  return report;
}

std::optional<spacetime::SolveReport> BodySession::Impl::try_from_rest(
    const Round& round, const spacetime::SolveReport& found) {
  if (!is_exact_) return found;
  const Eigen::MatrixXd motion = problem_->solver().motion();
  if (std::exchange(from_rest_, false)) tried_ = motion;
  const bool is_near = tried_.rows() == motion.rows() && tried_.cols() == motion.cols() &&
                       (motion - tried_).norm() <= kNear * tried_.norm();
  if (is_near) return found;
  auto corrections = problem_->take_corrections();
  const auto come_back = [&] {
    problem_->give_back(std::move(corrections));
    problem_->solver().warm_start(motion, spacetime::Known::kAnswer);
  };
  problem_->solver().cold_start();
  constexpr double kUnpublished = -std::numeric_limits<double>::infinity();
  std::optional<spacetime::SolveReport> other = solve_motion(round, kUnpublished);
  if (other) other = polish(round, *other, kUnpublished);
  if (!other) {
    come_back();  // the earlier edit begins in the answer, not on the path from rest
    return std::nullopt;
  }
  if (is_exact_ && problem_->solver().prefers(*other, found)) {
    tried_ = problem_->solver().motion();
    add_sentence(other->message,
                 fmt::format("From rest a lower optimum was found than the one that edits led to: "
                             "total energy {:.6g} instead of {:.6g}.",
                             other->total_energy, found.total_energy));
    return other;
  }
  const bool is_cancelled = other->status == SolveStatus::kCancelled;
  come_back();
  is_exact_ = true;
  if (!is_cancelled) tried_ = motion;
  spacetime::SolveReport kept = found;
  if (is_cancelled) kept.status = SolveStatus::kCancelled;
  return kept;
}

std::optional<Eigen::MatrixXf> BodySession::Impl::frames_in_full(
    const Round& round, const spacetime::Material& material, const Eigen::MatrixXd& modal,
    const Eigen::MatrixXf& reduced) {
  // An edit is noticed within a millisecond or so; a cancellation can take a little longer.
  const JobContext job{out_of_date_, [&](const auto& /*stage*/, double /*fraction*/) {
                         JobContext{round.cancellation, {}}.throw_if_cancelled();
                       }};
  ShowOptions options;
  options.tolerance =
      std::min(kLargestShapeError, kShapeShare * document_.unedited()->model.tolerance);
  const std::shared_ptr<const ShownBasis> before = problem_shown_;
  Eigen::MatrixXd mixed;
  FullBody::Shown shown;
  full_body_->set_added(problem_->added());
  const bool is_unwanted = is_given_up([&] {
    shown = full_body_->show(before->basis, mixed_motion(material, modal, mixed), reduced,
                             problem_->held_frames(), options, job);
  });
  if (is_unwanted) return std::nullopt;
  if (shown.basis != before->basis) {
    auto next = std::make_shared<ShownBasis>();
    next->basis = shown.basis;
    Geometry geometry =
        with_basis(*before->geometry, *document_.unedited(),
                   *read([this] { return built_; })->compact_of_source, *shown.basis);
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
  return std::move(shown.coordinates);
}

bool BodySession::Impl::show_exactly(const Round& round, BodyResult& result) {
  Eigen::MatrixXf reduced;
  problem_->model_coordinates(*result.material, result.modal, reduced);
  std::optional<Eigen::MatrixXf> frames =
      frames_in_full(round, *result.material, result.modal, reduced);
  if (!frames) return false;
  result.coordinates = std::move(*frames);
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
  shift->poses = result.material->mixing * result.modal;
  problem_->set_shift(std::move(shift));
}

void BodySession::Impl::set_shown(std::shared_ptr<const ShownBasis> shown) {
  problem_shown_ = shown;
  const std::lock_guard lock(mutex_);
  shown_.push_back(std::move(shown));
  if (shown_.size() > kShownKept) shown_.pop_front();
}

/// The solver continues from an answer, with all that belongs to it.
void BodySession::Impl::take_up(const BodyResult& answer, spacetime::Known known) {
  if (answer.mode_changes == mode_changes()) problem_->set_material(answer.material);
  start_of_fit_ = answer.start_of_fit;
  problem_->solver().set_weight_scale(answer.weight_scale);
  if (answer.mode_changes != mode_changes()) {
    // Its frames are in another basis, and its material has other modes, which are not fitted yet.
    start_of_fit_.reset();
    problem_->set_shift(nullptr);
    problem_->solver().warm_start(in_present_modes(answer), known);
    return;
  }
  if (!answer.is_exact) {
    problem_->set_shift(nullptr);
    problem_->solver().warm_start(answer.modal, known);
    return;
  }
  Eigen::MatrixXf reduced;
  problem_->model_coordinates(*answer.material, answer.modal, reduced);
  if (answer.shown != problem_shown_) set_shown(answer.shown);
  shift_frames(reduced, answer);
  problem_->solver().warm_start(answer.modal, known);
  tried_ = answer.modal;
  provide_full();
  problem_->anchor(known);
}

}  // namespace limber::session
