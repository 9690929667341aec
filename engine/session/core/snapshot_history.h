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

/// The steps of a document that stores whole values: the current value and those of undo and redo.
/// Values are shared, so that a step that is come back to is the very same object.
template <class ValueOfDocument>
class SnapshotHistory {
 public:
  using Value = ValueOfDocument;
  using Snapshot = std::shared_ptr<const Value>;

  /// All that there is to a history, to make the same again elsewhere.
  struct Parts {
    using Value = ValueOfDocument;
    Snapshot now;
    std::deque<Snapshot> undo, redo;              // newest last
    std::deque<StepNote> undo_notes, redo_notes;  // of these steps
    std::uint64_t last_number = 0;                // of the notes that were given
  };

  explicit SnapshotHistory(Value first) {
    parts_.now = std::make_shared<const Value>(std::move(first));
  }
  /// @pre as demand_history()
  explicit SnapshotHistory(Parts parts) : parts_(std::move(parts)) {}
  [[nodiscard]] const Parts& parts() const { return parts_; }

  [[nodiscard]] const Snapshot& now() const { return parts_.now; }
  /// The steps of undo, the newest last.
  [[nodiscard]] const std::deque<Snapshot>& undo_steps() const { return parts_.undo; }
  [[nodiscard]] std::size_t undo_count() const { return parts_.undo.size(); }
  [[nodiscard]] std::size_t redo_count() const { return parts_.redo.size(); }
  /// Note of the undo step of this age; 0: the newest.
  [[nodiscard]] const StepNote& note(std::size_t age) const {
    return at_age(parts_.undo_notes, age);
  }
  /// Note of the step that redo would restore; null: nothing.
  [[nodiscard]] const StepNote* redo_note() const {
    return parts_.redo_notes.empty() ? nullptr : &parts_.redo_notes.back();
  }
  [[nodiscard]] const Value& before(std::size_t age) const { return *at_age(parts_.undo, age); }
  [[nodiscard]] const Value& after(std::size_t age) const {
    return age == 0 ? *parts_.now : *at_age(parts_.undo, age - 1);
  }

  /// Adds a step of undo and discards the steps of redo. The oldest steps go where there are more
  /// than `depth`, or more than `bytes` of them by `bytes_of`; the newest stays at any size.
  /// @param note  gets its number here
  template <class BytesOf>
  void step_to(Value next, int depth, std::size_t bytes, const BytesOf& bytes_of,
               StepNote note = {}) {
    auto& undo = parts_.undo;
    undo.push_back(std::exchange(parts_.now, std::make_shared<const Value>(std::move(next))));
    note.number = ++parts_.last_number;
    parts_.undo_notes.push_back(std::move(note));
    parts_.redo.clear();
    parts_.redo_notes.clear();
    std::size_t taken = 0;
    for (const Snapshot& step : undo) taken += bytes_of(*step);
    while (undo.size() > static_cast<std::size_t>(depth) || (undo.size() > 1 && taken > bytes)) {
      taken -= bytes_of(*undo.front());
      undo.pop_front();
      parts_.undo_notes.pop_front();
    }
  }

  /// @throws Error{kFailedPrecondition} where there is nothing to undo or redo
  void undo() {
    move_by_one(parts_.undo, parts_.redo, "undo");
    move_note(parts_.undo_notes, parts_.redo_notes);
  }
  void redo() {
    move_by_one(parts_.redo, parts_.undo, "redo");
    move_note(parts_.redo_notes, parts_.undo_notes);
  }

 private:
  void move_by_one(std::deque<Snapshot>& from, std::deque<Snapshot>& to, const char* what) {
    if (from.empty())
      throw Error(ErrorCode::kFailedPrecondition, "", fmt::format("there is nothing to {}", what));
    to.push_back(std::exchange(parts_.now, from.back()));
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

  Parts parts_;
};

/// From Parts. @throws Error{kInvalidArgument} for members that do not fit each other, more steps
/// than undo is deep, and notes with numbers that were not given
template <class Parts>
void demand_history(const Parts& parts, int undo_depth) {
  const bool is_whole = parts.now && parts.undo.size() == parts.undo_notes.size() &&
                        parts.redo.size() == parts.redo_notes.size();
  if (!is_whole)
    throw Error(ErrorCode::kInvalidArgument, "history", "steps and notes of them do not fit");
  const std::size_t steps = parts.undo.size() + parts.redo.size();
  if (steps > static_cast<std::size_t>(undo_depth))
    throw Error(ErrorCode::kInvalidArgument, "history",
                fmt::format("{} steps of undo and redo, at most {}", steps, undo_depth));
  for (const auto* notes : {&parts.undo_notes, &parts.redo_notes}) {
    for (const StepNote& note : *notes) demand_step_given(note, parts.last_number);
  }
}

/// Calls `visit` with each value of Parts.
template <class Parts, class Visit>
void for_each_snapshot(const Parts& parts, const Visit& visit) {
  for (const auto& step : parts.undo) visit(*step);
  visit(*parts.now);
  for (const auto& step : parts.redo) visit(*step);
}

}  // namespace limber::session
