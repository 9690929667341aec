#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "engine/scene/linkage.h"
#include "engine/session/core/edit_request.h"
#include "engine/session/core/snapshot_history.h"
#include "engine/session/core/values.h"
#include "engine/session/linkages/edit.h"

namespace limber::session {

struct LinkageLimits {
  int undo_depth = 1000;  // requests that can be undone, >= 0
  int max_targets = 4096;
  std::size_t undo_bytes = std::size_t{256} << 20;  // kept for undo; the newest request always is
  /// The part for the shape of each request: answers are kept with their conditions, see
  /// EquilibriumCache.
  std::size_t shape_bytes = 0;
  /// Edges per segment that are chosen for a tolerance at most, >= 3.
  int most_chosen_edges = 60;
  /// Steps of undo that the edits of one request can begin besides the last, by an Undo or Redo
  /// behind them, >= 0: each is validated as a whole.
  int steps_at_once = 16;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// Edited conditions of a linkage, like Document for bodies. Not thread-safe, solves nothing.
///
/// A request of edits is applied whole or not at all. It is one revision and one step of undo: the
/// edits together must be valid, in any order. Undo and redo are edits too: they make new
/// revisions. Inside a request, an Undo or Redo ends the step begun by the edits before it.
class LinkageDocument {
  struct State {
    SnapshotHistory<scene::LinkageConditions> history;
    std::uint64_t last_id = 0;  // of targets
    bool is_return = false;     // does undo or redo end the last request
  };

 public:
  /// Issues that more is needed for than the conditions and these numbers.
  using Check = std::function<std::vector<scene::Issue>(const scene::LinkageConditions&)>;

  /// @param joints, segments  of the linkage
  /// @throws Error with a field of the conditions ("targets[3].joint")
  LinkageDocument(scene::LinkageConditions conditions, int joints, int segments,
                  LinkageLimits limits = {}, Check check = {});

  /// As of BeamDocument.
  struct Checkpoint {
    Revision revision = 0;
    SnapshotHistory<scene::LinkageConditions>::Parts history;
    std::uint64_t last_id = 0;  // the greatest that a target was given
    bool is_return = false;     // does undo or redo end the last request
  };
  [[nodiscard]] Checkpoint checkpoint() const {
    return {revision_, state_.history.parts(), state_.last_id, state_.is_return};
  }
  void demand_reachable(const Checkpoint& checkpoint) const;
  void begin_at(Checkpoint checkpoint);

  /// @returns with warnings of releases of what nothing holds, sets or loads
  /// @throws Error with field "edits[i]....": kNotFound, kAlreadyExists, kOutOfRange,
  /// kInvalidArgument, kLimitExceeded, kFailedPrecondition (nothing to undo);
  /// Error{kFailedPrecondition, "expected_revision"}; nothing has changed
  EditReceipt apply(const std::vector<LinkageEdit>& edits, std::optional<Revision> expected,
                    const Author& author = {}) {
    return commit(prepare(edits, expected, author));
  }
  /// apply() in two parts: what may take long and changes nothing, and what takes no time. The
  /// document must not change between them.
  using Prepared = PreparedEdits<State>;
  [[nodiscard]] Prepared prepare(const std::vector<LinkageEdit>& edits,
                                 std::optional<Revision> expected, const Author& author = {}) const;
  /// @param prepared  the state there was before is left in it: freeing it may take long
  EditReceipt commit(Prepared&& prepared);

  [[nodiscard]] Revision revision() const { return revision_; }
  [[nodiscard]] const std::shared_ptr<const scene::LinkageConditions>& conditions() const {
    return state_.history.now();
  }
  [[nodiscard]] std::size_t undo_count() const { return state_.history.undo_count(); }
  [[nodiscard]] std::size_t redo_count() const { return state_.history.redo_count(); }
  /// Conditions that undo can return to, the newest first, if the last edit was an undo or a redo;
  /// else empty.
  [[nodiscard]] std::vector<std::shared_ptr<const scene::LinkageConditions>> steps_before_return()
      const;

 private:
  class Request;
  static State first_state(scene::LinkageConditions conditions);
  [[nodiscard]] std::vector<scene::Issue> issues_of(
      const scene::LinkageConditions& conditions) const;

  int joints_, segments_;
  LinkageLimits limits_;
  Check check_;
  State state_;
  Revision revision_ = 0;
};

}  // namespace limber::session
