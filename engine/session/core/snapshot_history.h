#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <utility>

#include "engine/base/error.h"
#include "engine/session/core/step_notes.h"

namespace limber::session {

/// The steps of a document that keeps whole values: what holds now, what undo and redo go back to.
/// Values are shared, so that a step that is come back to is the very same object.
template <class Value>
class SnapshotHistory {
 public:
  using Snapshot = std::shared_ptr<const Value>;

  explicit SnapshotHistory(Value first) : now_(std::make_shared<const Value>(std::move(first))) {}

  [[nodiscard]] const Snapshot& now() const { return now_; }
  /// What undo goes back to, the newest last.
  [[nodiscard]] const std::deque<Snapshot>& undo_steps() const { return undo_; }
  [[nodiscard]] std::size_t undo_count() const { return undo_.size(); }
  [[nodiscard]] std::size_t redo_count() const { return redo_.size(); }
  /// Of the step of undo of this age; 0: the newest.
  [[nodiscard]] const StepNote& note(std::size_t age) const { return at_age(undo_notes_, age); }
  /// Of what redo would bring back; null: nothing.
  [[nodiscard]] const StepNote* redo_note() const {
    return redo_notes_.empty() ? nullptr : &redo_notes_.back();
  }
  [[nodiscard]] const Value& before(std::size_t age) const { return *at_age(undo_, age); }
  [[nodiscard]] const Value& after(std::size_t age) const {
    return age == 0 ? *now_ : *at_age(undo_, age - 1);
  }

  /// A step of undo; what could be redone is gone. The oldest steps go where there are more than
  /// `depth`, or more than `bytes` of them by `bytes_of`; the newest stays at any size.
  /// @param note  gets its number here
  template <class BytesOf>
  void step_to(Value next, int depth, std::size_t bytes, const BytesOf& bytes_of,
               StepNote note = {}) {
    undo_.push_back(std::exchange(now_, std::make_shared<const Value>(std::move(next))));
    note.number = ++last_number_;
    undo_notes_.push_back(std::move(note));
    redo_.clear();
    redo_notes_.clear();
    std::size_t taken = 0;
    for (const Snapshot& step : undo_) taken += bytes_of(*step);
    while (undo_.size() > static_cast<std::size_t>(depth) || (undo_.size() > 1 && taken > bytes)) {
      taken -= bytes_of(*undo_.front());
      undo_.pop_front();
      undo_notes_.pop_front();
    }
  }

  /// @throws Error{kFailedPrecondition} where there is nothing to undo or redo
  void undo() {
    move_by_one(undo_, redo_, "undo");
    move_note(undo_notes_, redo_notes_);
  }
  void redo() {
    move_by_one(redo_, undo_, "redo");
    move_note(redo_notes_, undo_notes_);
  }

 private:
  void move_by_one(std::deque<Snapshot>& from, std::deque<Snapshot>& to, const char* what) {
    if (from.empty())
      throw Error(ErrorCode::kFailedPrecondition, "", fmt::format("there is nothing to {}", what));
    to.push_back(std::exchange(now_, from.back()));
    from.pop_back();
  }

  static void move_note(std::deque<StepNote>& from, std::deque<StepNote>& to) {
    to.push_back(std::move(from.back()));
    from.pop_back();
  }
  template <class Item>
  static const Item& at_age(const std::deque<Item>& items, std::size_t age) {
    return items[items.size() - 1 - age];
  }

  Snapshot now_;
  std::deque<Snapshot> undo_, redo_;              // newest last
  std::deque<StepNote> undo_notes_, redo_notes_;  // of these steps
  std::uint64_t last_number_ = 0;
};

}  // namespace limber::session
