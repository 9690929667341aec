#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <deque>
#include <memory>
#include <utility>

#include "engine/base/error.h"

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

  /// A step of undo; what could be redone is gone. The oldest steps go where there are more than
  /// `depth`, or more than `bytes` of them by `bytes_of`; the newest stays at any size.
  template <class BytesOf>
  void step_to(Value next, int depth, std::size_t bytes, const BytesOf& bytes_of) {
    undo_.push_back(std::exchange(now_, std::make_shared<const Value>(std::move(next))));
    redo_.clear();
    std::size_t taken = 0;
    for (const Snapshot& step : undo_) taken += bytes_of(*step);
    while (undo_.size() > static_cast<std::size_t>(depth) || (undo_.size() > 1 && taken > bytes)) {
      taken -= bytes_of(*undo_.front());
      undo_.pop_front();
    }
  }

  /// @throws Error{kFailedPrecondition} where there is nothing to undo or redo
  void undo() { move_by_one(undo_, redo_, "undo"); }
  void redo() { move_by_one(redo_, undo_, "redo"); }

 private:
  void move_by_one(std::deque<Snapshot>& from, std::deque<Snapshot>& to, const char* what) {
    if (from.empty())
      throw Error(ErrorCode::kFailedPrecondition, "", fmt::format("there is nothing to {}", what));
    to.push_back(std::exchange(now_, from.back()));
    from.pop_back();
  }

  Snapshot now_;
  std::deque<Snapshot> undo_, redo_;  // newest last
};

}  // namespace limber::session
