#include "engine/session/bodies/live_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/scene/constraint_path.h"
#include "engine/spacetime/pose_shares.h"

namespace limber::session {

namespace {

/// [frames] of a constraint that acts in part of the time.
constexpr int kLeastReach = 1;

bool same_modes(const spacetime::Material& a, const spacetime::Material& b) {
  return a.dynamics.stiffness.size() == b.dynamics.stiffness.size() &&
         a.dynamics.stiffness == b.dynamics.stiffness && a.dynamics.damping == b.dynamics.damping &&
         a.dynamics.discretisation == b.dynamics.discretisation;
}

/// Whether forces cost the same on the same modes.
bool same_forces(const spacetime::Material& a, const spacetime::Material& b) {
  const Eigen::VectorXd &one = a.dynamics.shares, &other = b.dynamics.shares;
  return a.dynamics.smoothing == b.dynamics.smoothing && a.dynamics.scale == b.dynamics.scale &&
         one.size() == other.size() && one == other;
}

std::shared_ptr<const spacetime::Material> with_forces(const spacetime::Material& of,
                                                       const spacetime::Material& forces) {
  auto changed = std::make_shared<spacetime::Material>(of);
  changed->dynamics.smoothing = forces.dynamics.smoothing;
  changed->dynamics.scale = forces.dynamics.scale;
  changed->dynamics.shares = forces.dynamics.shares;
  return changed;
}

}  // namespace

Eigen::Ref<const Eigen::MatrixXd> mixed_motion(const spacetime::Material& material,
                                               const Eigen::MatrixXd& motion,
                                               Eigen::MatrixXd& work) {
  const bool plain =
      motion.rows() == material.coordinates() && spacetime::are_first_coordinates(material.mixing);
  if (plain) return motion;
  work.noalias() = material.mixing * motion;
  return work;
}

LiveProblem::LiveProblem(std::shared_ptr<const reduced::ReducedModel> model,
                         std::shared_ptr<const reduced::BaseMotion> base, TargetFrame targets,
                         std::unique_ptr<KeyframeTargets> keyframe_targets, ProblemTerms terms,
                         spacetime::SolverOptions options, SiteLimits limits)
    : model_(std::move(model)),
      base_(std::move(base)),
      targets_(std::move(targets)),
      keyframe_targets_(std::move(keyframe_targets)),
      terms_(terms),
      options_(options),
      limits_(limits) {}

void LiveProblem::start(const EditBatch& whole) {
  LIMBER_DEMAND(whole.ends && whole.dynamics && whole.material && whole.keyframes &&
                whole.moved.empty() && whole.removed.empty());
  solver_.reset();
  shift_.reset();
  held_.clear();
  projected_.clear();
  added_.reset();
  variables_ = whole.material->variables;
  frames_per_second_ = whole.dynamics->frames_per_second;
  dynamics_ = *whole.dynamics;
  // Made anew after a failure: the fit remains valid.
  bool again = material_ && epoch_ == whole.material->epoch;
  if (again) {
    const auto initial = mapped_material(is_fitted(*material_));
    again = same_modes(*initial, *initial_) && same_forces(*initial, *initial_);
  }
  if (!again) {
    material_ = initial_ = mapped_material(false);
  }
  epoch_ = whole.material->epoch;
  unfinished_.reset();
  first_end_ = whole.ends->first;
  make_solver({terms_.frame_count, map_end(whole.ends->first), map_end(whole.ends->last)});
  for (const scene::Constraint& constraint : whole.set) set(constraint);
  set_keyframes(whole.keyframes.value());
  set_added();
}

void LiveProblem::take_fitted(const LiveProblem& other) {
  initial_ = other.initial_;
  material_ = other.material_;
  epoch_ = other.epoch_;
  fitted_ = other.fitted_;
}

void LiveProblem::apply(const EditBatch& batch) {
  for (const std::uint64_t id : batch.removed) {
    const auto known = held_.find(id);
    if (known == held_.end()) continue;
    remove(id, known->second.frames);
    held_.erase(known);
  }
  if (batch.dynamics) set_frame_rate(batch.dynamics->frames_per_second);
  for (const scene::Constraint& constraint : batch.set) set(constraint);
  for (const TargetChange& move : batch.moved) {
    Held& held = held_.at(move.id);
    if (held.velocity) held.velocity->target = move.target;
    if (held.local) held.local->target = move.target;
    solver_->move(move.id, map_target(move.target, held));
  }
  if (batch.ends) set_ends(*batch.ends);
  if (batch.dynamics) {
    dynamics_ = *batch.dynamics;
    set_dynamics();
  }
  if (batch.material) {
    // The next fit may not change the mixing or tuning of a fit of other variables.
    if (variables_ != batch.material->variables) unfinished_.reset();
    variables_ = batch.material->variables;
    enter_epoch(batch.material->epoch);
    set_dynamics();
  }
  if (base_ && (batch.dynamics || batch.ends || batch.material)) solver_->set_load(load());
  if (batch.keyframes) set_keyframes(*batch.keyframes);
  const bool may_move_poses =
      batch.keyframes || ((batch.ends || batch.dynamics || batch.material) && added_);
  if (may_move_poses && set_added()) {
    set_shift(nullptr);  // of shapes without these poses
    solver_->warm_start(solver_->motion(), spacetime::Known::kGuess);
  }
  if (mostly_unused_sites()) shed_sites();
}

/// A reset can be undone: the fit before it is still available then.
void LiveProblem::enter_epoch(std::uint64_t epoch) {
  if (epoch == epoch_) return;
  fitted_.insert_or_assign(std::exchange(epoch_, epoch), material_);
  if (fitted_.size() > kMaxEpochs) fitted_.erase(fitted_.begin());
  const auto known = fitted_.find(epoch);
  set_material(known == fitted_.end() ? initial_ : known->second);
}

/// A fit to other modes starts anew from these. Other costs of forces leave it.
void LiveProblem::set_dynamics() {
  auto mapped = mapped_material(is_fitted(*material_));
  if (same_modes(*mapped, *initial_)) {
    if (!same_forces(*mapped, *initial_)) set_forces(std::move(mapped));
    return;
  }
  fitted_.clear();
  material_ = nullptr;
  initial_ = mapped_material(false);
  set_material(initial_);
}

bool LiveProblem::is_fitted(const spacetime::Material& material) const {
  return !same_modes(material, *initial_) || material.mixing.size() != initial_->mixing.size() ||
         material.mixing != initial_->mixing;
}

/// If a material is fitted, or was, forces count by themselves: measured by the displacements that
/// they would hold, a fit would make modes cheap by making them stiff.
std::shared_ptr<const spacetime::Material> LiveProblem::mapped_material(bool is_fitted) const {
  spacetime::Material mapped = map_material(dynamics_, terms_.mode_count, *model_);
  if (variables_ != scene::MaterialVariables::kMotion || is_fitted)
    mapped.dynamics.shares.resize(0);
  return std::make_shared<const spacetime::Material>(std::move(mapped));
}

void LiveProblem::set_forces(std::shared_ptr<const spacetime::Material> initial) {
  for (auto& [epoch, material] : fitted_)
    material = material == initial_ ? initial : with_forces(*material, *initial);
  auto material = material_ == initial_ ? initial : with_forces(*material_, *initial);
  initial_ = std::move(initial);
  set_material(std::move(material));
}

/// Materials of earlier answers return here: they get the present costs of forces.
void LiveProblem::set_material(std::shared_ptr<const spacetime::Material> material) {
  unfinished_.reset();
  const bool fitted = is_fitted(*material);
  if (auto mapped = mapped_material(fitted); !same_forces(*mapped, *initial_))
    initial_ = std::move(mapped);
  if (!fitted) {
    material = initial_;
  } else if (!same_forces(*material, *initial_)) {
    material = with_forces(*material, *initial_);
  }
  if (material == material_) return;
  material_ = std::move(material);
  solver_->set_material(*material_);
}

double LiveProblem::column_energy() const {
  return terms_.material.column_weight * spacetime::column_energy(material_->mixing);
}

bool LiveProblem::allows_high_frequencies() const {
  return terms_.material.max_frequency_hz &&
         *terms_.material.max_frequency_hz / frames_per_second_ >
             spacetime::MaterialOptions().max_frequency;
}

spacetime::MaterialSolver LiveProblem::material_solver(
    spacetime::MaterialOptions::MotionLimit limit) const {
  const auto is_local = [](const auto& one) { return one.second.local.has_value(); };
  if (std::any_of(held_.begin(), held_.end(), is_local)) {
    throw Error(ErrorCode::kUnsupported, "reach",
                "no material is fitted while constraints have a reach");
  }
  if (base_ && dynamics_.inertia > 0) {
    throw Error(ErrorCode::kUnsupported, "dynamics.inertia",
                "no material is fitted while the base motion has inertia");
  }
  spacetime::MaterialOptions options;
  options.limit = std::move(limit);
  options.variables = map_variables(variables_);
  options.column_weight = terms_.material.column_weight;
  options.held = model_->rigid_count;
  if (terms_.material.max_frequency_hz)
    options.max_frequency = std::min(0.5, *terms_.material.max_frequency_hz / frames_per_second_);
  options.slow_frequency = spacetime::slow_frequency_of(
      initial_->dynamics, reduced::reference_mode(model_->coordinate_count(), model_->rigid_count,
                                                  model_->mechanism_count));
  const int taken = unfinished_ ? unfinished_->steps : 0;
  options.slow_steps = material_ == initial_ ? std::max(0, terms_.material.slow_steps - taken) : 0;
  spacetime::MaterialSolver solver(kinematics_, solver_->timeline(), solver_->constraint_set(),
                                   *material_, solver_->motion(), options);
  if (unfinished_) solver.resume(unfinished_->material, unfinished_->motion);
  return solver;
}

void LiveProblem::keep_unfinished(const spacetime::MaterialSolver& fit, int steps) {
  const int before = unfinished_ ? unfinished_->steps : 0;
  unfinished_ = Unfinished{fit.material(), fit.motion(), before + steps};
}

void LiveProblem::use(reduced::LayeredKinematics::Level level) {
  if (kinematics_->level() == level) return;
  kinematics_->use(level);
  solver_->warm_start(solver_->motion(), spacetime::Known::kAnswer);
}

void LiveProblem::provide_full(
    const std::function<std::unique_ptr<reduced::FullKinematics>()>& make) {
  if (!kinematics_->has_full()) kinematics_->set_full(make());
}

void LiveProblem::anchor(spacetime::Known known) {
  std::vector<int> frames;
  std::vector<reduced::SiteQuery> queries;
  const auto add = [&](reduced::SiteId site, int frame) {
    queries.push_back({site, static_cast<int>(frames.size())});
    frames.push_back(frame);
  };
  for (const spacetime::PositionConstraint& constraint : solver_->constraints()) {
    add(constraint.site, constraint.frame);
    if (constraint.since) add(constraint.site, *constraint.since);
  }
  const Eigen::MatrixXd& motion = solver_->motion();
  const Eigen::MatrixXd z = material_->mixing * motion(Eigen::all, frames);
  kinematics_->anchor(frames, z, queries);
  solver_->warm_start(motion, known);
}

void LiveProblem::set_shift(std::shared_ptr<const reduced::FrameShift> shift) {
  shift_ = std::move(shift);
  kinematics_->set_shift(shift_);
}

reduced::LayeredKinematics::Corrections LiveProblem::take_corrections() {
  shift_.reset();
  return kinematics_->take_corrections();
}

void LiveProblem::give_back(reduced::LayeredKinematics::Corrections corrections) {
  shift_ = corrections.shift;
  kinematics_->give_back(std::move(corrections));
}

std::vector<HeldFrame> LiveProblem::held_frames() const {
  std::vector<HeldFrame> frames;
  for (const spacetime::PositionConstraint& constraint : solver_->constraints()) {
    const auto& site = held(constraint.id).site;
    frames.push_back({constraint.frame, site});
    if (constraint.since) frames.push_back({*constraint.since, site});
  }
  for (const scene::Keyframe& keyframe : keyframes_) frames.push_back({keyframe.frame, nullptr});
  return frames;
}

void LiveProblem::coordinates(const spacetime::Material& material, const Eigen::MatrixXd& motion,
                              Eigen::MatrixXf& q) const {
  coordinates(material, motion, {0, static_cast<int>(motion.cols())}, q);
}

void LiveProblem::coordinates(const spacetime::Material& material, const Eigen::MatrixXd& motion,
                              spacetime::FrameSpan frames, Eigen::MatrixXf& q) const {
  Eigen::MatrixXd mixed;
  kinematics_->reduced().coordinates(frames.first, mixed_motion(material, motion, mixed), q);
  if (!shift_) return;
  const Eigen::Index own = q.rows();
  q.conservativeResize(shift_->shift.rows(), Eigen::NoChange);
  q.bottomRows(q.rows() - own).setZero();
  const Eigen::VectorXf share =
      reduced::fading(mixed_motion(material, motion, mixed),
                      shift_->poses.middleCols(frames.first, frames.count))
          .cast<float>();
  q += shift_->shift.middleCols(frames.first, frames.count) * share.asDiagonal();
}

void LiveProblem::model_coordinates(const spacetime::Material& material,
                                    const Eigen::MatrixXd& motion, Eigen::MatrixXf& q) const {
  Eigen::MatrixXd mixed;
  kinematics_->reduced().coordinates(0, mixed_motion(material, motion, mixed), q);
}

ModeProblem LiveProblem::mode_problem(const scene::Dynamics& dynamics) const {
  ModeProblem problem;
  for (const spacetime::PositionConstraint& constraint : solver_->constraints())
    problem.constraints.emplace_back(constraint, held(constraint.id).site);
  problem.timeline = solver_->timeline();
  problem.load = load();
  problem.weight_scale = solver_->weight_scale();
  problem.dynamics = dynamics;
  return problem;
}

CheckRequest LiveProblem::check_request() const {
  CheckRequest request;
  for (const spacetime::PositionConstraint& constraint : solver_->constraints()) {
    request.targets.push_back({constraint.frame, constraint.since, held(constraint.id).site,
                               constraint.axes, constraint.target,
                               constraint.weight == spacetime::PositionConstraint::kExact,
                               constraint_of(constraint.id)});
  }
  for (const scene::Keyframe& keyframe : keyframes_)
    request.keyframe_frames.push_back(keyframe.frame);
  request.added = added_;
  request.model = model_;
  request.is_cyclic = solver_->timeline().is_cyclic();
  return request;
}

Eigen::Vector3d LiveProblem::map_target(const Eigen::Vector3d& target, const Held& held) const {
  const Eigen::Vector3d mapped = targets_.displacement(target, held.origin);
  return held.velocity ? Eigen::Vector3d(mapped / frames_per_second_) : mapped;
}

void LiveProblem::set_frame_rate(double frames_per_second) {
  if (std::exchange(frames_per_second_, frames_per_second) != frames_per_second) set_timed();
}

/// In a cycle velocities in its first and last frame read across the seam, elsewhere the solver
/// refuses them.
void LiveProblem::set_ends(const EndsChange& ends) {
  const bool was_cyclic = solver_->timeline().is_cyclic();
  const auto first = map_end(ends.first), last = map_end(ends.last);
  first_end_ = ends.first;
  const bool is_cyclic = first == spacetime::EndCondition::kCyclic;
  if (was_cyclic && !is_cyclic) set_timed();
  solver_->set_timeline(first, last);
  if (is_cyclic && !was_cyclic) set_timed();
}

void LiveProblem::set_timed() {
  std::vector<scene::Constraint> changed;
  for (const auto& [id, held] : held_)
    if (held.velocity || held.local)
      changed.push_back(held.velocity ? *held.velocity : *held.local);
  for (const scene::Constraint& constraint : changed) set(constraint);
}

void LiveProblem::set(const scene::Constraint& constraint) {
  Held held;
  held.site = std::make_shared<const reduced::Site>(targets_.site(constraint));
  held.origin = targets_.origin(constraint.kind, *held.site);
  spacetime::PositionConstraint mapped;
  mapped.frame = constraint.frame;
  mapped.site = kinematics_->add_site(*held.site);
  mapped.axes = constraint.axes;
  mapped.weight = constraint.weight;  // infinity is kExact
  if (constraint.kind == scene::TargetKind::kVelocity) {
    held.velocity = constraint;
    const auto span = scene::velocity_span(constraint.frame, terms_.frame_count, first_end_);
    mapped.since = span.since;
    mapped.frame = span.until;
    if (std::isfinite(mapped.weight)) {  // of errors per second to those per frame
      mapped.weight =
          std::min(scene::kGreatestWeight, mapped.weight * frames_per_second_ * frames_per_second_);
    }
  }
  if (constraint.reach) {
    held.local = constraint;
    mapped.reach = static_cast<int>(std::min(*constraint.reach * frames_per_second_ + 0.5,
                                             static_cast<double>(terms_.frame_count)));
    mapped.reach = std::max(*mapped.reach, kLeastReach);
  }
  note_site(mapped.site, held.site->nodes.size());
  held.frames = constraint.last_frame() - constraint.frame + 1;
  const auto known = held_.find(constraint.id);
  const int had = known == held_.end() ? 0 : known->second.frames;
  remove(constraint.id, had, held.frames);
  for (int i = 0; i < held.frames; ++i) {
    mapped.id = frame_of_path(constraint.id, i);
    if (i > 0) mapped.frame = constraint.frame + i;
    mapped.target = map_target(scene::target_in(constraint, constraint.frame + i), held);
    if (i < had) {
      solver_->replace(mapped);
    } else {
      solver_->add(mapped);
    }
  }
  held_[constraint.id] = std::move(held);
}

/// @param from  of its frames the first to go
void LiveProblem::remove(std::uint64_t id, int frames, int from) {
  for (int i = from; i < frames; ++i) solver_->remove(frame_of_path(id, i));
}

/// A keyframe may change the turns of those after it: all are projected again. Those that come out
/// the same stay in the solver as they are.
void LiveProblem::set_keyframes(std::vector<scene::Keyframe> keyframes) {
  std::map<std::uint64_t, KeyframeTarget> targets;
  for (auto& target : keyframe_targets_->project(keyframes))
    targets[target.constraint.id] = std::move(target);
  const auto stays = [&](std::uint64_t id) {
    return targets.contains(id) && projected_.contains(id) &&
           targets[id].constraint == projected_[id].constraint;
  };
  for (const auto& [id, target] : projected_)
    if (!stays(id)) solver_->remove_keyframe(id);
  for (const auto& [id, target] : targets)
    if (!stays(id)) solver_->add_keyframe(target.constraint);
  projected_ = std::move(targets);
  keyframes_ = std::move(keyframes);
}

/// @returns whether they are other ones than before
bool LiveProblem::set_added() {
  std::vector<spacetime::KeyframeConstraint> keyframes;
  std::vector<std::shared_ptr<const reduced::PoseRest>> rests;
  for (const auto& [id, target] : projected_) {
    keyframes.push_back(target.constraint);
    rests.push_back(target.rest);
  }
  std::vector<reduced::AddedPose> poses;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    if (!rests[k]) continue;
    poses.push_back({rests[k], keyframes[k].frame, keyframes[k].coordinates, {}});
    poses.back().share =
        spacetime::pose_share(k, keyframes, initial_->dynamics, solver_->timeline());
  }
  if (added_ ? added_->poses() == poses : poses.empty()) return false;
  added_ = poses.empty() ? nullptr : std::make_shared<const reduced::AddedPoses>(std::move(poses));
  kinematics_->set_added(added_);
  return true;
}

void LiveProblem::make_solver(const spacetime::Timeline& timeline) {
  kinematics_ = std::make_shared<reduced::LayeredKinematics>(
      std::make_shared<reduced::ReducedKinematics>(model_, base_));
  if (added_) kinematics_->set_added(added_);
  kinematics_->set_shift(shift_);
  site_count_ = 0;
  site_nodes_ = 0;
  solver_.emplace(kinematics_, material_->dynamics, timeline, options_, material_->mixing);
  solver_->set_load(load());
}

Eigen::MatrixXd LiveProblem::load() const {
  if (!base_ || dynamics_.inertia == 0) return {};
  return dynamics_.inertia * base_->load.of_modes(material_->mixing);
}

void LiveProblem::note_site(int site, std::size_t nodes) {
  if (site < site_count_) return;
  site_count_ = site + 1;
  site_nodes_ += nodes;
}

bool LiveProblem::mostly_unused_sites() const {
  if (site_count_ <= limits_.sites && site_nodes_ <= limits_.nodes) return false;
  std::size_t used = 0;
  for (const auto& [id, held] : held_) used += held.site->nodes.size();
  return held_.size() < static_cast<std::size_t>(limits_.sites) / 4 && used <= limits_.nodes / 4;
}

void LiveProblem::shed_sites() {
  const std::vector<spacetime::PositionConstraint> constraints = solver_->constraints();
  const double scale = solver_->weight_scale();
  make_solver(spacetime::Timeline(solver_->timeline()));
  for (auto constraint : constraints) {
    const reduced::Site& site = *held(constraint.id).site;
    constraint.site = kinematics_->add_site(site);
    note_site(constraint.site, site.nodes.size());
    solver_->add(constraint);
  }
  for (const auto& [id, keyframe] : projected_) solver_->add_keyframe(keyframe.constraint);
  solver_->set_weight_scale(scale);
}

}  // namespace limber::session
