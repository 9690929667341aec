#include "engine/session/bodies/motion_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "engine/session/bodies/frame_steps.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/session/bodies/reach.h"
#include "engine/session/bodies/session.h"

namespace limber::session {
namespace {

/// Training poses reach 1.25 times the amplitude of a typical one (reduced::PoseLevels).
constexpr double kTrainedShare = 1.25;

/// A soft target that is missed by more than this is no compromise of weights [body lengths].
constexpr double kMaxMissedLengths = 0.5;

/// Full shapes that miss a target by more than this times what the shown ones miss are reported.
constexpr double kMaxMissRatio = 1.5;

/// Largest steps of fitted motions, over those with forces alone. Less is no fault of a calm
/// motion.
constexpr double kMaxStepRatio = 1.5;

/// Factor on the reach of training poses: a body that bends farther to meet a target is torn apart.
constexpr double kFarReach = 4;

/// Beyond this the number says nothing more.
constexpr double kMaxShare = 10;

std::string percent(double share) {
  if (share > kMaxShare) return fmt::format("more than {:.0f} %", 100 * kMaxShare);
  return share < 1 ? fmt::format("{:.3g} %", 100 * share) : fmt::format("{:.0f} %", 100 * share);
}

/// Evenly spread numbers, at most `most` out of `count`, first and last included.
std::vector<int> spread(int count, int most) {
  std::vector<int> chosen;
  if (count <= most) most = count;
  for (int i = 0; i < most; ++i) {
    const std::int64_t last = count - 1;
    chosen.push_back(most == 1 ? 0 : static_cast<int>((last * i + (most - 1) / 2) / (most - 1)));
  }
  return chosen;
}

void sort_once(std::vector<int>& frames) {
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
}

bool is_worst_frame_off(const MotionCheck& check) {
  return check.error.worst_frame_error > check.tolerance;
}

bool is_out_of_reach(const MotionCheck& check) {
  return check.error.max_constraint_error > kMaxMissedLengths * check.length;
}

bool has_larger_steps(const MotionCheck& check) {
  return check.largest_step > kMaxStepRatio * check.largest_step_of_start;
}

void describe_shapes(const MotionCheck& check, std::vector<std::string>& sentences) {
  const reduced::MotionError& error = check.error;
  if (!check.within_tolerance()) {
    sentences.push_back(fmt::format(
        "The shown motion is off by {} from the full reconstruction of the same modes, {} in frame "
        "{} (model.tolerance is {}): {}.",
        percent(error.shape_error), percent(error.worst_frame_error), error.worst_frame,
        percent(check.tolerance),
        check.is_exact ? "energies and constraint errors are exact, the shown frames are not"
                       : "energies and constraint errors are those of the model"));
  } else if (is_worst_frame_off(check)) {
    sentences.push_back(fmt::format(
        "The shown motion is off by {} from the full reconstruction of the same modes in frame {}, "
        "more than model.tolerance ({}), though by {} only over all compared frames.",
        percent(error.worst_frame_error), error.worst_frame, percent(check.tolerance),
        percent(error.shape_error)));
  }
  if (error.inverted_tets > 0) {
    sentences.push_back(fmt::format(
        "{} {} inverted in frame {}, the worst of the {} frames compared.", error.inverted_tets,
        error.inverted_tets == 1 ? "tet is" : "tets are", error.inverted_frame, error.frames));
    const bool is_far = check.farthest_target > kFarTarget * check.length ||
                        error.linear_reach > kFarReach * check.trained_reach;
    if (is_far && check.farthest_target > 0) {
      sentences.push_back(fmt::format(
          "Constraint {} in frame {} is out of reach: its target is {:.3g} body lengths from rest, "
          "and the body meets it inside out.",
          check.farthest_target_id, check.farthest_target_frame,
          check.farthest_target / check.length));
    }
  }
}

/// Errors of the full shapes at constraints, next to those of the shown shapes.
void describe_misses(const MotionCheck& check, std::vector<std::string>& sentences) {
  const double missed = check.error.max_constraint_error;
  const double exact = check.error.max_exact_error;
  const double visible = kMinVisibleMiss * check.length;
  const auto in_units = [&](double distance) {
    return fmt::format("{:.3g} ({} of the body's length)", distance / check.length_unit,
                       percent(distance / check.length));
  };
  if (is_out_of_reach(check) && !check.is_reach_reported) {
    sentences.push_back(
        fmt::format("A constraint is missed by {:.2g} body lengths: its target is beyond the reach "
                    "of its nodes, or its weight is too small.",
                    missed / check.length));
  }
  if (check.constraint_tolerance && missed > *check.constraint_tolerance) {
    sentences.push_back(fmt::format(
        "The full shapes miss a constraint by {}, more than constraint_tolerance, {:g}.",
        in_units(missed), *check.constraint_tolerance / check.length_unit));
  }
  if (exact > visible) {
    sentences.push_back(
        fmt::format("The full shapes miss an exact constraint by {}.", in_units(exact)));
  }
  if (missed > std::max(kMaxMissRatio * check.shown_constraint_error,
                        check.shown_constraint_error + visible)) {
    sentences.push_back(fmt::format(
        "Constraints are missed by up to {} in the full shapes, {:.3g} in the shown ones.",
        in_units(missed), check.shown_constraint_error / check.length_unit));
  }
}

/// Errors of the full shapes' velocities, next to those of the shown shapes.
void describe_velocities(const MotionCheck& check, std::vector<std::string>& sentences) {
  const double missed = check.error.max_velocity_error, shown = check.shown_velocity_error;
  const double visible = kMinVisibleMiss * check.length / kVisibleFrames;
  const auto in_units = [&](double velocity) {
    return fmt::format("{:.3g} a second", velocity * check.frames_per_second / check.length_unit);
  };
  if (check.error.max_exact_velocity_error > visible) {
    sentences.push_back(fmt::format("The full shapes miss an exact velocity by {}.",
                                    in_units(check.error.max_exact_velocity_error)));
  }
  if (missed > std::max(kMaxMissRatio * shown, shown + visible)) {
    sentences.push_back(
        fmt::format("Velocities are missed by up to {} in the full shapes, {} in the shown ones.",
                    in_units(missed), in_units(shown)));
  }
}

/// Whether a finer model would help: shapes are off, or full ones miss more than shown ones.
bool is_of_model(const MotionCheck& check) {
  const reduced::MotionError& error = check.error;
  const double visible = kMinVisibleMiss * check.length;
  return !check.within_tolerance() || is_worst_frame_off(check) ||
         error.max_constraint_error > check.shown_constraint_error + visible ||
         error.max_exact_error > check.shown_exact_error + visible ||
         error.max_velocity_error > check.shown_velocity_error + visible / kVisibleFrames;
}

std::string describe_remedy(const MotionCheck& check) {
  const reduced::MotionError& error = check.error;
  // Training poses scatter about their typical reach by nearly a factor of two.
  if (error.linear_reach > 2 * check.trained_reach) {
    return fmt::format(
        "The motion is {}outside of what the model was trained for: its linear displacement is "
        "{:.2g} body lengths in frame {}, that of training poses about {:.2g}. Move targets nearer "
        "to where the body can go, spread them over more frames, or use keyframes or a base motion "
        "that leads there.",
        error.linear_reach > kFarReach * check.trained_reach ? "far " : "",
        error.linear_reach / check.length, error.reach_frame, check.trained_reach / check.length);
  }
  if (check.is_contradictory && check.within_tolerance() && error.inverted_tets == 0) {
    return "Exact constraints contradict each other: remove some, make them soft, or move their "
           "targets to where they agree. A finer model does not change that.";
  }
  if (is_out_of_reach(check) && check.within_tolerance() && error.inverted_tets == 0) {
    return "Move the target nearer, constrain a node that is farther from fixed ones, or raise the "
           "weight.";
  }
  if (error.inverted_tets > 0 && check.within_tolerance()) {
    return "Move targets nearer, constrain groups of nodes rather than single ones, or repair thin "
           "tets of the mesh.";
  }
  if (!is_of_model(check)) {
    return "The shown shapes miss it as much: move targets nearer, or raise weights. A finer model "
           "does not change that.";
  }
  return "A smaller model.tolerance, or a larger model.basis_size and model.cubature_size, makes "
         "the model finer; targets that are nearer make the error smaller.";
}

std::string describe_steps(const MotionCheck& check) {
  return fmt::format(
      "The fitted motion moves a node by up to {:.3g} from one frame to the next, {:.3g} times as "
      "far as the motion with forces alone that the fit began with: fix more frames or ends, set "
      "targets between these, or fit fewer variables.",
      check.largest_step / check.length_unit, check.largest_step / check.largest_step_of_start);
}

bool shakes(const MotionCheck& check) {
  return check.shaking.zigzag > kMaxZigzag * check.length ||
         check.shaking.high_frequency_share > kMaxHighFrequencyShare;
}

std::string describe_shaking(const MotionCheck& check) {
  std::vector<std::string> found;
  if (check.shaking.zigzag > kMaxZigzag * check.length) {
    found.push_back(fmt::format(
        "in frame {} a node is {:.2g} body lengths from the mean of its places one frame "
        "before and one after (limit {:g})",
        check.shaking.frame, check.shaking.zigzag / check.length, kMaxZigzag));
  }
  if (check.shaking.high_frequency_share > kMaxHighFrequencyShare) {
    found.push_back(
        fmt::format("{:.2g} of its power is above half the Nyquist frequency (limit {:g})",
                    check.shaking.high_frequency_share, kMaxHighFrequencyShare));
  }
  const bool alternates = check.shaking.high_frequency_share > kMaxHighFrequencyShare;
  return fmt::format(
      "The motion {}: {}. Set targets nearer, leave more frames between those that differ, make "
      "the motion calmer (dynamics.damping_ratio, dynamics.force_smoothing), or use soft weights.",
      alternates ? "shakes" : "is abrupt", fmt::join(found, "; "));
}

/// Far beyond all targets, to get from one exact one to the next.
bool is_thrown(const MotionCheck& check) {
  constexpr double kBeyondTargets = 2;
  return check.thrown.to > check.thrown.from &&
         check.thrown.distance > std::max(check.length, kBeyondTargets * check.farthest_target);
}

std::string describe_throw(const MotionCheck& check) {
  return fmt::format(
      "The body is thrown: in frame {} a node is {:.2g} body lengths from rest, the farthest "
      "target "
      "is {:.2g}. The cause are exact targets in frames {} and {}, which differ by {:.2g} body "
      "lengths: leave more frames between them, or make one of them soft.",
      check.thrown.frame, check.thrown.distance / check.length,
      check.farthest_target / check.length, check.thrown.from, check.thrown.to,
      check.thrown.apart / check.length);
}

/// Uses targets of positions in neighbouring frames of them, every pair of such frames.
void find_hurry(const std::vector<CheckRequest::Target>& targets, MotionCheck& check) {
  std::map<int, std::vector<const CheckRequest::Target*>> exact;
  for (const CheckRequest::Target& target : targets)
    if (target.is_exact && !target.since) exact[target.frame].push_back(&target);
  double fastest = 0;
  for (auto next = exact.begin(); next != exact.end() && std::next(next) != exact.end(); ++next) {
    const auto& [to, others] = *std::next(next);
    for (const auto* one : next->second) {
      for (const auto* other : others) {
        const double distance = (other->target - one->target).norm();
        if (distance <= fastest * (to - next->first)) continue;
        fastest = distance / (to - next->first);
        check.thrown.from = next->first;
        check.thrown.to = to;
        check.thrown.apart = distance;
      }
    }
  }
}

}  // namespace

std::string describe_motion(const MotionCheck& check) {
  std::vector<std::string> sentences;
  describe_shapes(check, sentences);
  describe_misses(check, sentences);
  describe_velocities(check, sentences);
  if (!sentences.empty()) sentences.push_back(describe_remedy(check));
  if (has_larger_steps(check)) sentences.push_back(describe_steps(check));
  if (is_thrown(check)) sentences.push_back(describe_throw(check));
  if (shakes(check)) sentences.push_back(describe_shaking(check));
  return fmt::format("{}", fmt::join(sentences, " "));
}

std::string describe_accuracy(const reduced::ModelReport& report, double tolerance) {
  if (report.met_tolerance) return {};
  return fmt::format(
      "The model misses its tolerance: mean error {} on poses held out of its training, "
      "model.tolerance is {}. Answers that are not exact yet are no better than that: ask for a "
      "larger model.tolerance, "
      "or give a larger model.basis_size and model.cubature_size.",
      percent(report.error_mean), percent(tolerance));
}

std::vector<int> frames_to_compare(std::vector<int> constrained,
                                   const Eigen::MatrixXf& coordinates) {
  sort_once(constrained);
  std::vector<int> frames;
  for (const int i : spread(static_cast<int>(constrained.size()), kMaxConstrainedFrames))
    frames.push_back(constrained[static_cast<std::size_t>(i)]);
  for (const int frame : spread(static_cast<int>(coordinates.cols()), kSpreadFrames))
    frames.push_back(frame);
  if (coordinates.cols() > 0) {
    Eigen::Index farthest =
        0;  // B is orthonormal: |q| is the root of the sum of squares over nodes
    coordinates.colwise().squaredNorm().maxCoeff(&farthest);
    frames.push_back(static_cast<int>(farthest));
  }
  sort_once(frames);
  return frames;
}

MotionChecker::MotionChecker(std::shared_ptr<const scene::Scene> scene,
                             std::shared_ptr<const reduced::ReducedModel> model)
    : scene_(std::move(scene)), model_(std::move(model)) {}
MotionChecker::~MotionChecker() = default;

/// Cancelled between stages only, after each: a drag that interrupts every check repeats none.
void MotionChecker::prepare(const JobContext& job) {
  if (!mapped_) {
    mapped_ = std::make_unique<const MappedBody>(map_body(*scene_));
    job.throw_if_cancelled();
  }
  if (scene_->base_motion.size() > 0 && base_.size() == 0) {
    base_ = map_base_motion(*scene_, mapped_->source_of_compact);
    job.throw_if_cancelled();
  }
  full_ = std::make_unique<reduced::FullShapes>(mapped_->body, model_, std::exchange(base_, {}));
  mapped_.reset();
}

MotionCheck MotionChecker::check(const CheckRequest& request, const JobContext& job) {
  const auto begin = std::chrono::steady_clock::now();
  if (!full_) {
    prepare(job);
    job.throw_if_cancelled();
  }
  full_->set_added(request.added);
  const BodyResult& result = *request.result;
  std::vector<int> constrained = request.keyframe_frames;
  for (const CheckRequest::Target& target : request.targets) {
    constrained.push_back(target.frame);
    if (target.since) constrained.push_back(*target.since);
  }
  reduced::ShownFrames shown;
  shown.frames = frames_to_compare(std::move(constrained), result.coordinates);
  const auto count = static_cast<Eigen::Index>(shown.frames.size());
  Eigen::MatrixXd modal(result.modal.rows(), count);
  if (result.shown) shown.basis = result.shown->basis;
  shown.coordinates.resize(result.coordinates.rows(), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    modal.col(i) = result.modal.col(shown.frames[static_cast<std::size_t>(i)]);
    shown.coordinates.col(i) = result.coordinates.col(shown.frames[static_cast<std::size_t>(i)]);
  }
  shown.modal = result.material ? Eigen::MatrixXd(result.material->mixing * modal) : modal;
  const auto column_of = [&](int frame) -> std::optional<int> {
    const auto at = std::lower_bound(shown.frames.begin(), shown.frames.end(), frame);
    if (at == shown.frames.end() || *at != frame) return std::nullopt;
    return static_cast<int>(at - shown.frames.begin());
  };
  for (const CheckRequest::Target& target : request.targets) {
    const std::optional<int> at = column_of(target.frame);
    const std::optional<int> since = target.since ? column_of(*target.since) : std::nullopt;
    if (!at || since.has_value() != target.since.has_value()) continue;
    shown.targets.push_back({*at, target.site, target.axes, target.target, target.is_exact, since});
  }
  MotionCheck check;
  check.error = reduced::motion_error(*full_, shown, job);
  check.length = model_->length;
  check.tolerance = scene_->model.tolerance;
  check.is_exact = request.result->is_exact;
  check.length_unit = scene_->length_unit_in_metres;
  for (const CheckRequest::Target& target : request.targets) {
    if (target.since || target.target.norm() <= check.farthest_target) continue;
    check.farthest_target = target.target.norm();
    check.farthest_target_frame = target.frame;
    check.farthest_target_id = target.id;
  }
  check.is_reach_reported = !result.out_of_reach.empty();
  check.is_contradictory = result.report.rank_deficient &&
                           result.report.max_exact_error > kMinVisibleMiss * model_->length;
  check.shown_constraint_error = result.report.max_constraint_error;
  check.shown_exact_error = result.report.max_exact_error;
  check.shown_velocity_error = result.report.max_velocity_error;
  check.frames_per_second = result.frames_per_second;
  if (scene_->constraint_tolerance)
    check.constraint_tolerance = *scene_->constraint_tolerance * check.length_unit;
  const Eigen::MatrixXd& basis = result.shown ? *result.shown->basis : model_->basis;
  FarthestMove shaking = request.is_cyclic ? zigzag(basis, around_seam(result.coordinates), job)
                                           : zigzag(basis, result.coordinates, job);
  if (request.is_cyclic) shaking.frame = std::max(0, shaking.frame - 1);
  check.shaking.zigzag = shaking.distance;
  check.shaking.frame = shaking.frame;
  const FarthestMove farthest = farthest_from_rest(basis, result.coordinates, job);
  check.thrown.distance = farthest.distance;
  check.thrown.frame = farthest.frame;
  if (scene_->base_motion.size() == 0) find_hurry(request.targets, check);
  check.shaking.high_frequency_share = result.high_frequency_share.value_or(0);
  if (request.start_of_fit) {
    check.largest_step = largest_frame_step(basis, result.coordinates, job);
    check.largest_step_of_start = largest_frame_step(model_->basis, *request.start_of_fit, job);
  }
  check.trained_reach = kTrainedShare * reduced::ModelOptions().amplitude * model_->length;
  check.check_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return check;
}

}  // namespace limber::session
