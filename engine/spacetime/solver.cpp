#include "engine/spacetime/solver.h"

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/local_frames.h"
#include "engine/spacetime/optimizer.h"

namespace limber::spacetime {
namespace {

[[noreturn]] void refuse_problem(const std::string& field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

int checked_pinned_frames(EndCondition end, const std::string& field) {
  const std::optional<int> frames = pinned_frames(end);
  if (!frames) refuse_problem(field, field + " is not an end condition");
  return *frames;
}

void validate(const Timeline& timeline) {
  if (timeline.is_cyclic() != (timeline.last == EndCondition::kCyclic))
    refuse_problem("timeline.last", "either both ends are cyclic, or none");
  const int pinned = checked_pinned_frames(timeline.first, "timeline.first") +
                     checked_pinned_frames(timeline.last, "timeline.last");
  if (timeline.frame_count < 3) {
    refuse_problem(
        "timeline.frame_count",
        "timeline.frame_count = " + std::to_string(timeline.frame_count) + " must be >= 3");
  }
  if (timeline.frame_count <= pinned) {
    refuse_problem("timeline.frame_count",
                   "timeline.frame_count = " + std::to_string(timeline.frame_count) +
                       " must be > " + std::to_string(pinned) +
                       ", the frames that the end conditions pin");
  }
}

void validate_column(const Eigen::VectorXd& values, const std::string& name) {
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    if (!(values[k] >= 0) || !(values[k] <= 1e12)) {
      refuse_problem(name, name + "[" + std::to_string(k) + "] = " + std::to_string(values[k]) +
                               " must be in [0, 1e12]");
    }
  }
}

void validate(const ModeDynamics& dynamics) {
  if (dynamics.stiffness.size() == 0)
    refuse_problem("dynamics.stiffness", "dynamics.stiffness must name at least one mode");
  if (dynamics.damping.size() != dynamics.stiffness.size()) {
    refuse_problem("dynamics.damping",
                   "dynamics.damping has " + std::to_string(dynamics.damping.size()) +
                       " modes, stiffness " + std::to_string(dynamics.stiffness.size()));
  }
  validate_column(dynamics.stiffness, "dynamics.stiffness");
  validate_column(dynamics.damping, "dynamics.damping");
  if (!is_discretisation(dynamics.discretisation))
    refuse_problem("dynamics.discretisation", "dynamics.discretisation is not a discretisation");
  if (!is_smoothing(dynamics.smoothing)) {
    refuse_problem("dynamics.smoothing",
                   "dynamics.smoothing = " + std::to_string(dynamics.smoothing) +
                       " must be in [0, 1e6] frames");
  }
  if (!are_force_weights(dynamics)) {
    refuse_problem(
        "dynamics.scale",
        "dynamics.scale and shares must be > 0 and finite, shares of all modes or of none");
  }
}

void validate_target(const Eigen::Vector3d& target) {
  if (!target.allFinite()) refuse_problem("constraint.target", "constraint.target must be finite");
}

void validate(const PositionConstraint& constraint, const Timeline& timeline) {
  const int frame_count = timeline.frame_count;
  if (constraint.frame < 0 || constraint.frame >= frame_count) {
    throw Error(ErrorCode::kOutOfRange, "constraint.frame",
                "constraint.frame = " + std::to_string(constraint.frame) + " must be in [0, " +
                    std::to_string(frame_count) + ")");
  }
  const bool is_cyclic = timeline.is_cyclic();
  if (constraint.since && (*constraint.since < 0 || *constraint.since == constraint.frame ||
                           *constraint.since >= (is_cyclic ? frame_count : constraint.frame))) {
    throw Error(ErrorCode::kOutOfRange, "constraint.since",
                "constraint.since = " + std::to_string(*constraint.since) +
                    (is_cyclic ? " must be another frame than constraint.frame"
                               : " must be in [0, " + std::to_string(constraint.frame) +
                                     "), before constraint.frame"));
  }
  if (constraint.reach && *constraint.reach < 0)
    refuse_problem("constraint.reach", "constraint.reach must be >= 0 frames");
  if (constraint.site < 0) {
    throw Error(ErrorCode::kOutOfRange, "constraint.site",
                "constraint.site = " + std::to_string(constraint.site) + " must be >= 0");
  }
  if (constraint.axes == 0 || constraint.axes > 7) {
    refuse_problem("constraint.axes",
                   "constraint.axes = " + std::to_string(constraint.axes) + " must be in [1, 7]");
  }
  if (!(constraint.weight > 0))
    refuse_problem("constraint.weight", "constraint.weight must be > 0");
  if (std::isfinite(constraint.weight) && constraint.weight > 1e12) {
    refuse_problem("constraint.weight",
                   "constraint.weight must be <= 1e12, or infinite to hold exactly");
  }
  validate_target(constraint.target);
}

void validate_mixing(const Eigen::MatrixXd& mixing, Eigen::Index modes, int coordinates) {
  if (mixing.size() == 0 && modes > coordinates) {
    refuse_problem("dynamics.stiffness", "dynamics.stiffness has " + std::to_string(modes) +
                                             " modes, the kinematics only " +
                                             std::to_string(coordinates) + " coordinates");
  }
  if (mixing.size() != 0 && (mixing.rows() != coordinates || mixing.cols() != modes)) {
    refuse_problem("mixing", "mixing is " + std::to_string(mixing.rows()) + " x " +
                                 std::to_string(mixing.cols()) + ", it must be " +
                                 std::to_string(coordinates) + " x " + std::to_string(modes));
  }
  if (!mixing.allFinite()) refuse_problem("mixing", "mixing must be finite");
}

void validate(const KeyframeConstraint& keyframe, int frame_count, int coordinates) {
  if (keyframe.frame < 0 || keyframe.frame >= frame_count) {
    throw Error(ErrorCode::kOutOfRange, "keyframe.frame",
                "keyframe.frame = " + std::to_string(keyframe.frame) + " must be in [0, " +
                    std::to_string(frame_count) + ")");
  }
  if (keyframe.coordinates.size() != coordinates || !keyframe.coordinates.allFinite()) {
    refuse_problem("keyframe.coordinates",
                   "keyframe.coordinates must be " + std::to_string(coordinates) +
                       " finite values, it has " + std::to_string(keyframe.coordinates.size()));
  }
  if (!(keyframe.weight > 0)) refuse_problem("keyframe.weight", "keyframe.weight must be > 0");
  if (std::isfinite(keyframe.weight) && keyframe.weight > 1e12)
    refuse_problem("keyframe.weight",
                   "keyframe.weight must be <= 1e12, or infinite to hold exactly");
}

Error not_found(ConstraintId id) {
  return {ErrorCode::kNotFound, "constraint.id", "there is no constraint " + std::to_string(id)};
}

}  // namespace

void SolverOptions::validate() const {
  auto inside = [](double value, double upper, const char* name, const char* rule) {
    if (!(value > 0) || !(value < upper)) {
      refuse_problem(name,
                     std::string(name) + " = " + std::to_string(value) + " must be in " + rule);
    }
  };
  inside(gradient_tolerance, 1, "options.gradient_tolerance", "(0, 1)");
  inside(constraint_tolerance, 1, "options.constraint_tolerance", "(0, 1)");
  inside(rank_tolerance, std::nextafter(1e-3, 1.0), "options.rank_tolerance", "(0, 1e-3]");
  if (max_iterations <= 0) {
    refuse_problem("options.max_iterations",
                   "options.max_iterations = " + std::to_string(max_iterations) + " must be > 0");
  }
}

/// Border frames of windows are keyframes of the optimiser, of numbers that no caller has.
constexpr ConstraintId kBorder = ConstraintId{1} << 63U;

/// Edits are cheap notes here; the optimiser gets them when the next answer is requested.
///
/// If constraints have a reach, there is a second solver, `base_`, of all other constraints. Its
/// motion holds outside their windows: unchanged, and for the optimiser as exact keyframes at the
/// borders.
class Solver::Impl {
 public:
  Impl(std::shared_ptr<const reduced::Kinematics> kinematics, ModeDynamics dynamics,
       Timeline timeline, const SolverOptions& options, Eigen::MatrixXd mixing)
      : kinematics_(std::move(kinematics)),
        dynamics_(std::move(dynamics)),
        timeline_(timeline),
        options_(options),
        mixing_(std::move(mixing)),
        coordinates_(kinematics_->coordinate_count()),
        optimizer_(kinematics_, dynamics_, timeline_, options, mixing_) {}

  void bring_up_to_date() {
    if (!stale_) return;
    local_ = local_frames(constraints_, timeline_);
    if (local_.empty()) {
      base_.reset();
    } else {
      if (!base_) {
        base_ = std::make_unique<Impl>(kinematics_, dynamics_, timeline_, options_, mixing_);
        base_->optimizer_.warm_start(optimizer_.motion(), Known::kGuess);
        base_->set_load(load_);
      }
      base_->take_unlimited(constraints_, weight_scale_);
      base_->bring_up_to_date();
    }
    optimizer_.set_structure(held());
    stale_ = false;
  }

  [[nodiscard]] ConstraintSet weighed() const {
    ConstraintSet set = constraints_;
    for (auto& [id, constraint] : set.positions) constraint.weight *= weight_scale_;
    for (auto& [id, keyframe] : set.keyframes) keyframe.weight *= weight_scale_;
    return set;
  }

  /// weighed(), and the base's motion at the borders of the windows.
  [[nodiscard]] ConstraintSet held() const {
    ConstraintSet set = weighed();
    if (!base_) return set;
    const int width = dynamics_.smoothing > 0 ? 3 : 2;
    const Eigen::MatrixXd& motion = base_->optimizer_.motion();
    for (const int frame : border_frames(local_, timeline_, width)) {
      KeyframeConstraint border{kBorder + static_cast<ConstraintId>(frame), frame,
                                Eigen::VectorXd::Zero(coordinates_), PositionConstraint::kExact};
      if (mixing_.size() > 0) {
        border.coordinates = mixing_ * motion.col(frame);
      } else {
        border.coordinates.head(motion.rows()) = motion.col(frame);
      }
      set.keyframes[border.id] = std::move(border);
    }
    return set;
  }

  /// Other ends, dynamics or modes: these first, in the base, too.
  void set_systems(ModeDynamics dynamics, const Timeline& timeline, Eigen::MatrixXd mixing) {
    if (base_) base_->set_systems(dynamics, timeline, mixing);
    dynamics_ = std::move(dynamics);
    timeline_ = timeline;
    mixing_ = std::move(mixing);
    local_ = local_frames(constraints_, timeline_);
    optimizer_.set_material(dynamics_, mixing_, timeline_, held());
    stale_ = base_ != nullptr || !local_.empty();
  }

  void set_load(const Eigen::MatrixXd& load) {
    if (base_) base_->set_load(load);
    load_ = load;
    optimizer_.set_load(load, dynamics_, timeline_, held());
    stale_ = base_ != nullptr || !local_.empty();
  }

  void target_moved(const PositionConstraint& constraint, const Eigen::Vector3d& from) {
    if (stale_) return;
    optimizer_.target_moved(constraint, from);
    if (!base_ || constraint.reach) return;
    base_->constraints_.positions.at(constraint.id).target = constraint.target;
    base_->target_moved(constraint, from);
  }

  SolveReport solve(const JobContext& job,
                    const std::function<bool(const SolveReport&)>& on_improved) {
    bring_up_to_date();
    if (!base_) return optimizer_.solve(job, on_improved);
    SolveReport known = optimizer_.correct();
    const SolveReport base = base_->solve(
        job, [&](const SolveReport& /*improved*/) { return !on_improved || on_improved(known); });
    known.status = base.status;
    if (base.status == SolveStatus::kCancelled || base.status == SolveStatus::kImproved)
      return known;
    if (const ConstraintSet now = held(); has_moved_borders(now)) {
      const Eigen::MatrixXd begin = motion();
      optimizer_.set_structure(now);
      optimizer_.warm_start(begin, Known::kGuess);
    }
    SolveReport report = optimizer_.solve(job, on_improved);
    if (report.status == SolveStatus::kConverged && base.status != SolveStatus::kConverged) {
      report.status = base.status;
      report.message = base.message;
    }
    return report;
  }

  [[nodiscard]] const Eigen::MatrixXd& motion() const {
    if (!base_) return optimizer_.motion();
    motion_ = optimizer_.motion();
    for (std::size_t frame = 0; frame < local_.size(); ++frame) {
      const auto column = static_cast<Eigen::Index>(frame);
      if (!local_[frame]) motion_.col(column) = base_->optimizer_.motion().col(column);
    }
    return motion_;
  }

  std::shared_ptr<const reduced::Kinematics> kinematics_;
  ModeDynamics dynamics_;
  Timeline timeline_;
  SolverOptions options_;
  Eigen::MatrixXd mixing_, load_;
  int coordinates_;
  ConstraintSet constraints_;
  double weight_scale_ = 1;
  bool stale_ = false;  // constraints_ differ from the optimiser's in more than targets
  Optimizer optimizer_;
  std::unique_ptr<Impl> base_;
  std::vector<bool> local_;  // frames of the windows
  mutable Eigen::MatrixXd motion_;

 private:
  /// The constraints without a reach.
  void take_unlimited(const ConstraintSet& all, double weight_scale) {
    ConstraintSet unlimited = all;
    std::erase_if(unlimited.positions,
                  [](const auto& one) { return one.second.reach.has_value(); });
    stale_ = stale_ || weight_scale != weight_scale_ ||
             unlimited.positions != constraints_.positions ||
             unlimited.keyframes != constraints_.keyframes;
    constraints_ = std::move(unlimited);
    weight_scale_ = weight_scale;
  }

  /// Whether the base's motion at the borders is another one than the optimiser knows.
  [[nodiscard]] bool has_moved_borders(const ConstraintSet& now) {
    std::map<ConstraintId, KeyframeConstraint> borders(now.keyframes.lower_bound(kBorder),
                                                       now.keyframes.end());
    const bool has_moved = borders != borders_;
    borders_ = std::move(borders);
    return has_moved;
  }

  std::map<ConstraintId, KeyframeConstraint> borders_;
};

Solver::Solver(std::shared_ptr<const reduced::Kinematics> kinematics, ModeDynamics dynamics,
               Timeline timeline, SolverOptions options, Eigen::MatrixXd mixing) {
  if (!kinematics) refuse_problem("kinematics", "kinematics must not be null");
  options.validate();
  validate(timeline);
  validate(dynamics);
  const Eigen::Index modes = dynamics.stiffness.size();
  const int coordinates = kinematics->coordinate_count();
  validate_mixing(mixing, modes, coordinates);
  if (!(kinematics->length() > 0) || !std::isfinite(kinematics->length())) {
    refuse_problem("kinematics.length", "kinematics.length must be positive and finite");
  }
  impl_ = std::make_unique<Impl>(std::move(kinematics), std::move(dynamics), timeline, options,
                                 std::move(mixing));
}

Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

void Solver::add(const PositionConstraint& constraint) {
  validate(constraint, impl_->timeline_);
  if (!impl_->constraints_.positions.emplace(constraint.id, constraint).second) {
    throw Error(ErrorCode::kAlreadyExists, "constraint.id",
                "there already is a constraint " + std::to_string(constraint.id));
  }
  impl_->stale_ = true;
}

void Solver::move(ConstraintId id, const Eigen::Vector3d& target) {
  validate_target(target);
  const auto found = impl_->constraints_.positions.find(id);
  if (found == impl_->constraints_.positions.end()) throw not_found(id);
  const Eigen::Vector3d from = std::exchange(found->second.target, target);
  impl_->target_moved(found->second, from);
}

void Solver::replace(const PositionConstraint& constraint) {
  validate(constraint, impl_->timeline_);
  const auto found = impl_->constraints_.positions.find(constraint.id);
  if (found == impl_->constraints_.positions.end()) throw not_found(constraint.id);
  PositionConstraint moved = found->second;
  moved.target = constraint.target;
  const bool only_target = moved.frame == constraint.frame && moved.site == constraint.site &&
                           moved.since == constraint.since && moved.axes == constraint.axes &&
                           moved.weight == constraint.weight && moved.reach == constraint.reach;
  if (only_target) return move(constraint.id, constraint.target);
  found->second = constraint;
  impl_->stale_ = true;
}

void Solver::remove(ConstraintId id) {
  if (impl_->constraints_.positions.erase(id) == 0) throw not_found(id);
  impl_->stale_ = true;
}

void Solver::add_keyframe(const KeyframeConstraint& keyframe) {
  validate(keyframe, impl_->timeline_.frame_count, impl_->coordinates_);
  if (!impl_->constraints_.keyframes.emplace(keyframe.id, keyframe).second) {
    throw Error(ErrorCode::kAlreadyExists, "keyframe.id",
                "there already is a keyframe " + std::to_string(keyframe.id));
  }
  impl_->stale_ = true;
}

void Solver::remove_keyframe(ConstraintId id) {
  if (impl_->constraints_.keyframes.erase(id) == 0) {
    throw Error(ErrorCode::kNotFound, "keyframe.id", "there is no keyframe " + std::to_string(id));
  }
  impl_->stale_ = true;
}

ConstraintSet Solver::constraint_set() const { return impl_->weighed(); }

void Solver::set_weight_scale(double scale) {
  if (!(scale >= 1e-12 && scale <= 1e12))
    refuse_problem("weight_scale", "weight_scale must be in [1e-12, 1e12]");
  if (std::exchange(impl_->weight_scale_, scale) != scale) impl_->stale_ = true;
}

double Solver::weight_scale() const { return impl_->weight_scale_; }

void Solver::set_timeline(EndCondition first, EndCondition last) {
  const Timeline timeline{impl_->timeline_.frame_count, first, last};
  validate(timeline);
  if (first == impl_->timeline_.first && last == impl_->timeline_.last) return;
  impl_->set_systems(impl_->dynamics_, timeline, impl_->mixing_);
}

void Solver::set_load(const Eigen::MatrixXd& load) {
  const bool fits = load.rows() == impl_->dynamics_.stiffness.size() &&
                    load.cols() == impl_->timeline_.frame_count && load.allFinite();
  if (load.size() > 0 && !fits)
    refuse_problem("load", "the load must have a finite number for each mode and frame");
  if (load.size() == 0 && impl_->load_.size() == 0) return;
  impl_->set_load(load);
}

void Solver::set_dynamics(ModeDynamics dynamics) {
  validate(dynamics);
  if (dynamics.stiffness.size() != impl_->dynamics_.stiffness.size()) {
    refuse_problem("dynamics.stiffness", "dynamics.stiffness has " +
                                             std::to_string(dynamics.stiffness.size()) +
                                             " modes, it must keep its " +
                                             std::to_string(impl_->dynamics_.stiffness.size()));
  }
  impl_->set_systems(std::move(dynamics), impl_->timeline_, impl_->mixing_);
}

void Solver::set_material(Material material) {
  validate(material.dynamics);
  const Eigen::Index modes = material.dynamics.stiffness.size();
  if (modes != impl_->dynamics_.stiffness.size()) {
    refuse_problem("dynamics.stiffness", "dynamics.stiffness has " + std::to_string(modes) +
                                             " modes, it must keep its " +
                                             std::to_string(impl_->dynamics_.stiffness.size()));
  }
  validate_mixing(material.mixing, modes, impl_->coordinates_);
  impl_->set_systems(std::move(material.dynamics), impl_->timeline_, std::move(material.mixing));
}

std::vector<PositionConstraint> Solver::constraints() const {
  std::vector<PositionConstraint> all;
  all.reserve(impl_->constraints_.positions.size());
  for (const auto& [id, constraint] : impl_->constraints_.positions) all.push_back(constraint);
  return all;
}

void Solver::cold_start() {
  impl_->bring_up_to_date();
  if (impl_->base_) impl_->base_->optimizer_.cold_start();
  impl_->optimizer_.cold_start();
}

void Solver::warm_start(const Eigen::MatrixXd& motion, Known known) {
  const Eigen::MatrixXd& now = impl_->optimizer_.motion();
  if (motion.rows() != now.rows() || motion.cols() != now.cols() || !motion.allFinite()) {
    refuse_problem("motion", "motion must be " + std::to_string(now.rows()) + " x " +
                                 std::to_string(now.cols()) + " finite values");
  }
  impl_->bring_up_to_date();
  if (impl_->base_) impl_->base_->optimizer_.warm_start(motion, Known::kGuess);
  impl_->optimizer_.warm_start(motion, known);
}

bool Solver::prefers(const SolveReport& report, const SolveReport& other) const {
  return impl_->optimizer_.beats(report, other);
}

SolveReport Solver::correct() {
  impl_->bring_up_to_date();
  return impl_->optimizer_.correct();
}

SolveReport Solver::solve(const JobContext& job,
                          const std::function<bool(const SolveReport&)>& on_improved) {
  return impl_->solve(job, on_improved);
}

const Eigen::MatrixXd& Solver::motion() const { return impl_->motion(); }

Eigen::MatrixXd Solver::motion_in(FrameSpan frames) const {
  const int all = impl_->timeline_.frame_count;
  if (frames.first < 0 || frames.count < 0 || frames.first > all - frames.count)
    throw Error(ErrorCode::kOutOfRange, "frames", "frames must be within the motion");
  if (impl_->base_) return impl_->motion().middleCols(frames.first, frames.count);
  return impl_->optimizer_.motion_in(frames);
}

int Solver::frames_to_fill(FrameSpan frames) const {
  return impl_->optimizer_.frames_to_fill(frames);
}

const Timeline& Solver::timeline() const { return impl_->timeline_; }
const ModeDynamics& Solver::dynamics() const { return impl_->dynamics_; }

}  // namespace limber::spacetime
