#include "engine/scene/keyframe_rules.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

#include "engine/scene/pose_rules.h"

namespace limber::scene {
namespace {

Issue error(const char* field, std::string message, ErrorCode code = ErrorCode::kInvalidArgument) {
  return {Issue::Severity::kError, field, std::move(message), code};
}

}  // namespace

KeyframeRules::KeyframeRules(const Scene& scene)
    : frame_count_(scene.frame_count),
      nodes_(scene.mesh.node_count()),
      reach_(reach_of_poses(scene)) {}

std::vector<Issue> KeyframeRules::faults(const Keyframe& keyframe) const {
  std::vector<Issue> found;
  for (auto fault :
       {frame_fault(keyframe.frame), weight_fault(keyframe.weight), pose_fault(keyframe)}) {
    if (fault) found.push_back(std::move(*fault));
  }
  return found;
}

std::optional<Issue> KeyframeRules::frame_fault(int frame) const {
  if (frame >= 0 && frame < frame_count_) return std::nullopt;
  return error("frame", fmt::format("frame {} is outside 0 .. {}", frame, frame_count_ - 1),
               ErrorCode::kOutOfRange);
}

std::optional<Issue> KeyframeRules::weight_fault(double weight) {
  // Written so that NaN fails.
  if (!(weight > 0))
    return error("weight", fmt::format("must be > 0, is {:g} ({})", weight, kHowToHoldExactly));
  if (std::isfinite(weight) && (weight < kLeastWeight || weight > kGreatestWeight)) {
    return error("weight",
                 fmt::format("must be in [{:g}, {:g}], is {:g} ({})", kLeastWeight, kGreatestWeight,
                             weight, kHowToHoldExactly),
                 ErrorCode::kOutOfRange);
  }
  return std::nullopt;
}

std::optional<Issue> KeyframeRules::pose_fault(const Keyframe& keyframe) const {
  if (!keyframe.pose) return error("pose", "a keyframe needs a pose");
  if (nodes_ == 0) return std::nullopt;
  const Eigen::VectorXd& pose = *keyframe.pose;
  if (pose.size() != 3 * Eigen::Index{nodes_}) {
    return error("pose", fmt::format("has {} nodes, the mesh has {}", pose.size() / 3, nodes_));
  }
  auto fault = scene::pose_fault(pose, reach_);
  if (fault) fault->field = "pose";
  return fault;
}

std::optional<Issue> KeyframeRules::idle_frame(int frame, End first_end, End last_end) const {
  if (!idle_frame_warning(frame, frame_count_, first_end, last_end)) return std::nullopt;
  return Issue{
      Issue::Severity::kWarning, "frame",
      fmt::format("frame {} is held by the end condition: the keyframe cannot change it", frame)};
}

std::vector<Issue> keyframe_issues(const Scene& scene) {
  std::vector<Issue> issues;
  if (scene.keyframes.size() > static_cast<std::size_t>(kMaxKeyframes)) {
    issues.push_back(
        error("keyframes",
              fmt::format("{} keyframes, the limit is {}", scene.keyframes.size(), kMaxKeyframes),
              ErrorCode::kLimitExceeded));
    return issues;
  }
  const KeyframeRules rules(scene);
  std::set<std::uint64_t> ids;
  std::map<int, std::size_t> at;
  for (std::size_t i = 0; i < scene.keyframes.size(); ++i) {
    const Keyframe& keyframe = scene.keyframes[i];
    const auto note = [&](Issue issue) {
      issue.field = fmt::format("keyframes[{}].{}", i, issue.field);
      issues.push_back(std::move(issue));
    };
    if (keyframe.id != 0 && !ids.insert(keyframe.id).second) {
      note(error("id", fmt::format("the id {} is taken", keyframe.id), ErrorCode::kAlreadyExists));
    }
    for (Issue& fault : rules.faults(keyframe)) note(std::move(fault));
    if (rules.frame_fault(keyframe.frame)) continue;
    const auto [first, fresh] = at.emplace(keyframe.frame, i);
    if (!fresh) {
      note(error("frame",
                 fmt::format("frame {} has a keyframe already: keyframes[{}]", keyframe.frame,
                             first->second),
                 ErrorCode::kAlreadyExists));
    }
    if (auto idle = rules.idle_frame(keyframe.frame, scene.first_end, scene.last_end))
      note(std::move(*idle));
  }
  return issues;
}

}  // namespace limber::scene
