#include "engine/session/bodies/keyframe_set.h"

#include <fmt/format.h>

#include <utility>

#include "engine/base/error.h"
#include "engine/session/core/limit_error.h"

namespace limber::session {
namespace {

void throw_if(const std::optional<scene::Issue>& fault, const std::string& prefix) {
  if (fault) throw Error(fault->code, prefix + fault->field, fault->message);
}

}  // namespace

KeyframeSet::KeyframeSet(const scene::Scene& scene) : rules_(scene) {
  for (const scene::Issue& issue : scene::keyframe_issues(scene)) {
    if (issue.severity == scene::Issue::Severity::kError)
      throw Error(issue.code, issue.field, issue.message);
  }
  for (const scene::Keyframe& keyframe : scene.keyframes) {
    if (keyframe.id != 0) keyframes_.emplace(keyframe.id, keyframe);
  }
  if (!keyframes_.empty()) next_id_ = keyframes_.rbegin()->first + 1;
  for (scene::Keyframe keyframe : scene.keyframes) {
    if (keyframe.id != 0) continue;
    number(keyframe);
    keyframes_.emplace(keyframe.id, keyframe);
  }
}

KeyframeChange KeyframeSet::added(const scene::Keyframe& added_value) {
  for (const scene::Issue& fault : rules_.faults(added_value)) throw_if(fault, "keyframe.");
  if (keyframes_.size() >= static_cast<std::size_t>(scene::kMaxKeyframes)) {
    const std::size_t count = keyframes_.size() + 1;
    throw LimitError(
        "keyframe",
        fmt::format("{} keyframes: more than the limit of {}", count, scene::kMaxKeyframes),
        static_cast<std::uint64_t>(scene::kMaxKeyframes), count);
  }
  demand_free_frame(added_value.frame, 0, "keyframe.frame");
  scene::Keyframe keyframe = added_value;
  if (keyframe.id == 0) {
    number(keyframe);
  } else if (keyframes_.contains(keyframe.id)) {
    throw Error(ErrorCode::kAlreadyExists, "keyframe.id",
                fmt::format("id {} is taken; 0 lets the session choose one", keyframe.id));
  } else if (keyframe.id >= next_id_) {
    next_id_ = keyframe.id + 1;
  }
  const std::uint64_t id = keyframe.id;
  return {id, std::move(keyframe)};
}

KeyframeShift KeyframeSet::moved(const MoveKeyframe& edit) const {
  demand_known(edit.id);
  const scene::Keyframe& held = keyframes_.at(edit.id);
  KeyframeShift shift{edit.id, edit.frame.value_or(held.frame), edit.weight.value_or(held.weight)};
  throw_if(rules_.frame_fault(shift.frame), "");
  throw_if(scene::KeyframeRules::weight_fault(shift.weight), "");
  demand_free_frame(shift.frame, edit.id, "frame");
  return shift;
}

KeyframeChange KeyframeSet::removed(std::uint64_t id) const {
  demand_known(id);
  return {id, std::nullopt};
}

void KeyframeSet::exchange(KeyframeChange& change) {
  const auto held = keyframes_.find(change.id);
  if (held == keyframes_.end()) {
    LIMBER_DEMAND(change.value.has_value());
    keyframes_.emplace(change.id, std::move(*change.value));
    change.value.reset();  // the inverse: absent again
  } else if (change.value) {
    std::swap(*change.value, held->second);
  } else {
    change.value = std::move(held->second);
    keyframes_.erase(held);
  }
}

void KeyframeSet::exchange(KeyframeShift& shift) {
  const auto held = keyframes_.find(shift.id);
  LIMBER_DEMAND(held != keyframes_.end());
  std::swap(shift.frame, held->second.frame);
  std::swap(shift.weight, held->second.weight);
}

std::vector<scene::Keyframe> KeyframeSet::list() const {
  std::vector<scene::Keyframe> list;
  list.reserve(keyframes_.size());
  for (const auto& [id, keyframe] : keyframes_) list.push_back(keyframe);
  return list;
}

void KeyframeSet::number(scene::Keyframe& keyframe) {
  while (next_id_ == 0 || keyframes_.contains(next_id_)) ++next_id_;
  keyframe.id = next_id_++;
}

void KeyframeSet::demand_known(std::uint64_t id) const {
  if (!keyframes_.contains(id))
    throw Error(ErrorCode::kNotFound, "id", fmt::format("there is no keyframe {}", id));
}

void KeyframeSet::demand_free_frame(int frame, std::uint64_t self, const char* field) const {
  for (const auto& [id, keyframe] : keyframes_) {
    if (keyframe.frame != frame || id == self) continue;
    throw Error(
        ErrorCode::kAlreadyExists, field,
        fmt::format("frame {} has keyframe {} already: remove or move that first", frame, id));
  }
}

}  // namespace limber::session
