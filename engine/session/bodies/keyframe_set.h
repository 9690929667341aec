#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "engine/scene/keyframe_rules.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/changes.h"
#include "engine/session/bodies/edit.h"

namespace limber::session {

/// The keyframes of a document, at most one in a frame. Poses are shared with the changes made to
/// them, never copied.
class KeyframeSet {
 public:
  /// @throws Error with a field of the scene ("keyframes[3].frame")
  explicit KeyframeSet(const scene::Scene& scene);

  // The change that an edit makes; fields of errors are relative to the edit ("keyframe.frame",
  // "id"). An added keyframe is numbered: next_id() advances.
  [[nodiscard]] KeyframeChange added(const scene::Keyframe& added_value);
  [[nodiscard]] KeyframeShift moved(const MoveKeyframe& edit) const;
  [[nodiscard]] KeyframeChange removed(std::uint64_t id) const;

  /// Makes a change; it becomes its inverse.
  void exchange(KeyframeChange& change);
  void exchange(KeyframeShift& shift);

  /// Takes over the keyframes of a copy, and leaves it those there were.
  void exchange_edited(KeyframeSet& copy) {
    std::swap(keyframes_, copy.keyframes_);
    std::swap(next_id_, copy.next_id_);
  }

  /// @pre numbered, one in a frame at most
  void replace(const std::vector<scene::Keyframe>& keyframes) {
    keyframes_.clear();
    for (const scene::Keyframe& keyframe : keyframes) keyframes_.emplace(keyframe.id, keyframe);
  }

  [[nodiscard]] const std::map<std::uint64_t, scene::Keyframe>& all() const { return keyframes_; }
  [[nodiscard]] std::vector<scene::Keyframe> list() const;  // by id
  [[nodiscard]] const scene::KeyframeRules& rules() const { return rules_; }
  [[nodiscard]] std::uint64_t next_id() const { return next_id_; }
  /// Back to an earlier next_id(): ids given since then are free again.
  void set_next_id(std::uint64_t id) { next_id_ = id; }

 private:
  void number(scene::Keyframe& keyframe);
  void demand_known(std::uint64_t id) const;
  /// Of any keyframe but `self`.
  void demand_free_frame(int frame, std::uint64_t self, const char* field) const;

  scene::KeyframeRules rules_;
  std::map<std::uint64_t, scene::Keyframe> keyframes_;
  std::uint64_t next_id_ = 1;  // never goes back, so that an id is not given twice
};

}  // namespace limber::session
