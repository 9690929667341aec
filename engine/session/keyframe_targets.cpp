#include "engine/session/keyframe_targets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/reduced/modal_projection.h"
#include "engine/session/problem_mapping.h"

namespace limber::session {
namespace {

using scene::Keyframe;

reduced::ProjectionOptions projection_options() {
  reduced::ProjectionOptions options;
  options.tets = reduced::ProjectionTets::kAll;
  return options;
}

[[noreturn]] void refuse(const Keyframe& keyframe, const std::string& why) {
  throw Error(ErrorCode::kNumerical, "keyframes",
              fmt::format("keyframe {} in frame {} has no modal coordinates: {}", keyframe.id,
                          keyframe.frame, why));
}

}  // namespace

struct KeyframeTargets::Tools {
  Tools(const scene::Scene& scene, const reduced::ReducedModel& model)
      : mapped(map_body(scene)), projector(mapped.body, model, projection_options()) {}

  MappedBody mapped;
  reduced::ModalProjector projector;
};

KeyframeTargets::KeyframeTargets(const scene::Scene& scene,
                                 std::shared_ptr<const reduced::ReducedModel> model)
    : scene_(scene), model_(std::move(model)) {}
KeyframeTargets::~KeyframeTargets() = default;

KeyframeTargets::Tools& KeyframeTargets::tools() {
  if (!tools_) tools_ = std::make_unique<Tools>(scene_, *model_);
  return *tools_;
}

Eigen::MatrixXd KeyframeTargets::project_poses(const std::vector<Keyframe>& ordered) {
  const Tools& with = tools();
  Eigen::MatrixXd poses(3 * Eigen::Index{model_->node_count},
                        static_cast<Eigen::Index>(ordered.size()));
  reduced::KeyframesOnBase on_base;
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    poses.col(static_cast<Eigen::Index>(k)) =
        map_displacements(scene_, *ordered[k].pose, with.mapped.source_of_compact);
    on_base.frames.push_back(ordered[k].frame);
  }
  reduced::ModalProjection projection;
  try {
    if (scene_.base_motion.size() > 0) {
      on_base.base_motion = map_base_motion(scene_, with.mapped.source_of_compact);
      projection = with.projector.keyframes(poses, on_base);
    } else {
      projection = with.projector.keyframes(poses);
    }
  } catch (const Error& error) {
    for (std::size_t k = 0; k < ordered.size(); ++k)
      if (error.field() == fmt::format("poses[{}]", k)) refuse(ordered[k], error.what());
    throw;
  }
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    if (!projection.z.col(static_cast<Eigen::Index>(k)).allFinite())
      refuse(ordered[k], "they are not finite");
  }
  return projection.z;
}

void KeyframeTargets::project_unknown(const std::vector<Keyframe>& ordered) {
  std::erase_if(known_, [](const auto& entry) { return entry.first.expired(); });
  std::vector<Keyframe> unknown;
  for (const Keyframe& keyframe : ordered)
    if (!known_.contains(keyframe.pose)) unknown.push_back(keyframe);
  if (unknown.empty()) return;
  const Eigen::MatrixXd z = project_poses(unknown);
  for (std::size_t k = 0; k < unknown.size(); ++k)
    known_[unknown[k].pose] = z.col(static_cast<Eigen::Index>(k));
}

std::vector<spacetime::KeyframeConstraint> KeyframeTargets::project(
    const std::vector<Keyframe>& keyframes) {
  if (keyframes.empty()) return {};
  std::vector<Keyframe> ordered = keyframes;
  std::sort(ordered.begin(), ordered.end(),
            [](const Keyframe& a, const Keyframe& b) { return a.frame < b.frame; });
  const bool alone =
      scene_.base_motion.size() == 0 && tools().projector.keyframes_are_independent();
  Eigen::MatrixXd z;
  if (alone) {
    project_unknown(ordered);
  } else {
    z = project_poses(ordered);
  }
  std::vector<spacetime::KeyframeConstraint> targets;
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    const Keyframe& keyframe = ordered[k];
    targets.push_back(
        {keyframe.id, keyframe.frame,
         alone ? known_.at(keyframe.pose) : Eigen::VectorXd(z.col(static_cast<Eigen::Index>(k))),
         keyframe.weight});  // infinity is kExact
  }
  return targets;
}

double KeyframeTargets::max_error(const std::vector<Keyframe>& keyframes,
                                  const Eigen::MatrixXf& coordinates) {
  double most = 0;
  for (const Keyframe& keyframe : keyframes) {
    const Eigen::VectorXd pose =
        map_displacements(scene_, *keyframe.pose, tools().mapped.source_of_compact);
    const Eigen::VectorXd miss =
        model_->basis * coordinates.col(keyframe.frame).cast<double>() - pose;
    most = std::max(most, miss.reshaped(3, miss.size() / 3).colwise().norm().maxCoeff());
  }
  return most;
}

}  // namespace limber::session
