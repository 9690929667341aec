#pragma once

#include <algorithm>
#include <vector>

#include "engine/session/bodies/document.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session::test {

inline std::vector<std::uint64_t> ids(const Document& document) {
  std::vector<std::uint64_t> list;
  for (const auto& [id, constraint] : document.constraints()) list.push_back(id);
  return list;
}

inline Document with_two() {
  scene::Scene scene = two_tets();
  scene.constraints = {held(3, 2, {0.1, 0, 0}), held(4, 1, {0, 0.2, 0})};
  return Document(scene);
}

inline EditReceipt edit_all(Document& document, const std::vector<BodyEdit>& edits) {
  Touched touched;
  return document.apply(edits, {}, touched);
}

/// Everything a client can see of a document, for comparison.
struct DocumentState {
  std::vector<scene::Constraint> constraints;
  std::vector<scene::Keyframe> keyframes;
  scene::End first, last;
  scene::Dynamics dynamics;
  PinPaths pins;
  bool operator==(const DocumentState& other) const {
    if (constraints.size() != other.constraints.size()) return false;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      if (!same(constraints[i], other.constraints[i])) return false;
    }
    const auto alike = [](const scene::Keyframe& a, const scene::Keyframe& b) {
      return a.id == b.id && a.frame == b.frame && a.weight == b.weight && a.pose == b.pose;
    };
    if (!std::equal(keyframes.begin(), keyframes.end(), other.keyframes.begin(),
                    other.keyframes.end(), alike))
      return false;
    return first == other.first && last == other.last && pins == other.pins &&
           dynamics.frames_per_second == other.dynamics.frames_per_second &&
           dynamics.period_frames == other.dynamics.period_frames &&
           dynamics.damping_ratio == other.dynamics.damping_ratio;
  }
};

inline DocumentState state_of(const Document& document) {
  return {document.constraint_list(), document.keyframe_list(), document.first_end(),
          document.last_end(),        document.dynamics(),      document.pins()};
}

}  // namespace limber::session::test
