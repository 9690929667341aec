#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>

#include "engine/session/bodies/changes.h"
#include "engine/session/core/step_notes.h"

namespace limber::session {

/// The constraint or keyframe that something is about; 0: none of its kind, or several.
struct TouchedIds {
  std::uint64_t constraint = 0, keyframe = 0;
  bool operator==(const TouchedIds&) const = default;
};
[[nodiscard]] TouchedIds touched_by(const Change& change);
[[nodiscard]] TouchedIds touched_by(const ChangeGroup& group);

/// An object that both groups change, in words; empty: none. All keyframes are one thing: there is
/// one in a frame at most.
[[nodiscard]] std::string common_thing(const ChangeGroup& one, const ChangeGroup& other);

/// One change for each thing that `changes` are made to, in place of all those made to it. Their
/// number is that of the things, for any change of them.
/// @param changes  inverses of a step's edits, oldest first: the result takes the step back, too.
/// An object that is absent before and after comes out as a ConstraintChange or KeyframeChange
/// without a value.
[[nodiscard]] ChangeGroup merged(std::span<const Change> changes);

/// Groups that each take a document one step back (or forth), newest last, and their size.
class ChangeSteps {
 public:
  struct Step {
    std::shared_ptr<const ChangeGroup> group;
    std::uint64_t content = 0;  // of the document once it is applied
    TouchedIds ids;
    std::size_t bytes = 0;
    StepNote note;
  };
  void push(std::shared_ptr<const ChangeGroup> group, std::uint64_t content, StepNote note = {});
  Step pop_newest();
  void drop_oldest();
  void clear() { *this = {}; }
  [[nodiscard]] bool empty() const { return steps_.empty(); }
  [[nodiscard]] std::size_t size() const { return steps_.size(); }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  /// @param age  0: the newest
  [[nodiscard]] const Step& at_age(std::size_t age) const {
    return steps_[steps_.size() - 1 - age];
  }

 private:
  std::deque<Step> steps_;
  std::size_t bytes_ = 0;
};

}  // namespace limber::session
