#include "engine/session/bodies/keyframe_targets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "engine/base/error.h"
#include "engine/reduced/modal_projection.h"
#include "engine/session/bodies/problem_mapping.h"

namespace limber::session {
namespace {

using scene::Keyframe;

constexpr double kPoorShare = 0.02;  // body lengths
// Share of the model's tolerance: rms of the rotations [rad] and strains of a pose that modes may
// miss. A body that is off by so much everywhere is off by less than that in body lengths.
constexpr double kShownShare = 0.1;
constexpr std::size_t kPosesAtOnce = 8;  // what modes leave of them takes memory

reduced::ProjectionOptions projection_options() {
  reduced::ProjectionOptions options;
  options.tets = reduced::ProjectionTets::kAll;
  options.rest = reduced::ProjectionRest::kKept;
  return options;
}

[[noreturn]] void refuse_keyframe(const Keyframe& keyframe, const std::string& why) {
  throw Error(ErrorCode::kNumerical, "keyframes",
              fmt::format("keyframe {} in frame {} has no modal coordinates: {}", keyframe.id,
                          keyframe.frame, why));
}

}  // namespace

struct KeyframeTargets::Tools {
  Tools(const scene::Scene& scene, const reduced::ReducedModel& model)
      : mapped(map_body(scene)), projector(mapped.body, model, projection_options()) {
    if (scene.base_motion.size() > 0)
      base.emplace(projector.track(map_base_motion(scene, mapped.source_of_compact)));
  }

  MappedBody mapped;
  reduced::ModalProjector projector;
  std::optional<reduced::TrackedBase> base;
};

KeyframeTargets::KeyframeTargets(const scene::Scene& scene,
                                 std::shared_ptr<const reduced::ReducedModel> model)
    : scene_(scene), model_(std::move(model)) {}
KeyframeTargets::~KeyframeTargets() = default;

KeyframeTargets::Tools& KeyframeTargets::tools() {
  if (!tools_) tools_ = std::make_unique<Tools>(scene_, *model_);
  return *tools_;
}

std::vector<KeyframeTargets::Projected> KeyframeTargets::project_poses(
    const std::vector<Keyframe>& ordered) {
  Tools& with = tools();
  Eigen::MatrixXd poses(3 * Eigen::Index{model_->node_count},
                        static_cast<Eigen::Index>(ordered.size()));
  std::vector<int> frames;
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    poses.col(static_cast<Eigen::Index>(k)) =
        map_displacements(scene_, *ordered[k].pose, with.mapped.source_of_compact);
    frames.push_back(ordered[k].frame);
  }
  reduced::ModalProjection projection;
  try {
    projection = with.base ? with.projector.keyframes(poses, frames, *with.base)
                           : with.projector.keyframes(poses);
  } catch (const Error& error) {
    for (std::size_t k = 0; k < ordered.size(); ++k)
      if (error.field() == fmt::format("poses[{}]", k)) refuse_keyframe(ordered[k], error.what());
    throw;
  }
  std::vector<Projected> projected;
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    if (!projection.z.col(column).allFinite() || !projection.rest.col(column).allFinite() ||
        (projection.beyond.size() > 0 && !projection.beyond.col(column).allFinite()))
      refuse_keyframe(ordered[k], "they are not finite");
    projected.push_back({projection.z.col(column), nullptr});
    const bool is_beyond = projection.beyond.size() > 0 && !projection.beyond.col(column).isZero(0);
    if (!is_beyond && !(projection.rest_size[column] > kShownShare * scene_.model.tolerance))
      continue;
    projected.back().rest = std::make_shared<const reduced::PoseRest>(reduced::PoseRest{
        projection.rest.col(column),
        is_beyond ? Eigen::VectorXd(projection.beyond.col(column)) : Eigen::VectorXd(),
        model_->basis.transpose() * poses.col(column)});
  }
  return projected;
}

void KeyframeTargets::project_unknown(const std::vector<Keyframe>& ordered) {
  std::set<Place> present;
  for (const Keyframe& keyframe : ordered) present.insert(place(keyframe));
  std::erase_if(known_, [&](const auto& entry) { return !present.contains(entry.first); });
  std::vector<Keyframe> unknown;
  for (const Keyframe& keyframe : ordered)
    if (!known_.contains(place(keyframe))) unknown.push_back(keyframe);
  if (unknown.empty()) return;
  for (std::size_t first = 0; first < unknown.size(); first += kPosesAtOnce) {
    const auto end = std::min(first + kPosesAtOnce, unknown.size());
    const std::vector<Keyframe> some(unknown.begin() + static_cast<std::ptrdiff_t>(first),
                                     unknown.begin() + static_cast<std::ptrdiff_t>(end));
    std::vector<Projected> projected = project_poses(some);
    for (std::size_t k = 0; k < some.size(); ++k) known_[place(some[k])] = std::move(projected[k]);
  }
}

std::vector<KeyframeTarget> KeyframeTargets::project(const std::vector<Keyframe>& keyframes) {
  if (keyframes.empty()) return {};
  std::vector<Keyframe> ordered = keyframes;
  std::sort(ordered.begin(), ordered.end(),
            [](const Keyframe& a, const Keyframe& b) { return a.frame < b.frame; });
  const bool alone = tools().projector.keyframes_are_independent();
  std::vector<Projected> together;
  if (alone) {
    project_unknown(ordered);
  } else {
    together = project_poses(ordered);
  }
  std::vector<KeyframeTarget> targets;
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    const Keyframe& keyframe = ordered[k];
    const Projected& projected = alone ? known_.at(place(keyframe)) : together[k];
    // A weight of infinity is kExact.
    targets.push_back(
        {{keyframe.id, keyframe.frame, projected.coordinates, keyframe.weight}, projected.rest});
  }
  return targets;
}

KeyframeMiss KeyframeTargets::miss(const std::vector<Keyframe>& keyframes,
                                   const Eigen::MatrixXd& basis,
                                   const Eigen::MatrixXf& coordinates) {
  KeyframeMiss most;
  for (const Keyframe& keyframe : keyframes) {
    const Eigen::VectorXd pose =
        map_displacements(scene_, *keyframe.pose, tools().mapped.source_of_compact);
    const Eigen::VectorXd miss = basis * coordinates.col(keyframe.frame).cast<double>() - pose;
    const double distance = miss.reshaped(3, miss.size() / 3).colwise().norm().maxCoeff();
    most.distance = std::max(most.distance, distance);
    if (std::isfinite(keyframe.weight) || !(distance > kPoorShare * model_->length)) continue;
    if (most.poor_id != 0 && distance <= most.poor_share * model_->length) continue;
    most.poor_id = keyframe.id;
    most.poor_frame = keyframe.frame;
    most.poor_share = distance / model_->length;
  }
  return most;
}

}  // namespace limber::session
