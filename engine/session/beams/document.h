#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "engine/session/beams/conditions.h"
#include "engine/session/beams/edit.h"
#include "engine/session/core/edit_request.h"
#include "engine/session/core/snapshot_history.h"

namespace limber::session {

struct BeamLimits {
  int undo_depth = 1000;                           // requests that can be undone, >= 0
  std::size_t undo_bytes = std::size_t{64} << 20;  // kept for undo; the newest request always is
  int steps_at_once = 16;                          // as of LinkageLimits, >= 0

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// The loads and supports of a structure of beams under edits, like LinkageDocument for linkages.
/// Not thread-safe, solves nothing.
///
/// A request of edits is applied whole or not at all. It is one revision and one step of undo: the
/// edits together must be valid, in any order. Undo and redo are edits too; inside a request they
/// end the step begun by the edits before. Temporary loads are of the step that has them.
class BeamDocument {
  using History = SnapshotHistory<BeamConditions>;

 public:
  /// The position of a node in the newest shape, as the motion that would hold it there.
  /// @throws Error where that is not known
  class Places {
   public:
    virtual ~Places() = default;
    [[nodiscard]] virtual beams::PrescribedMotion of(int node) const = 0;
  };

  /// @throws Error as beams::validate and BeamLimits::validate
  explicit BeamDocument(beams::BeamModel model, BeamLimits limits = {});

  /// The result of all edits, with the steps that undo and redo lead to: it replaces the edits.
  struct Checkpoint {
    Revision revision = 0;
    History::Parts history;
  };
  [[nodiscard]] Checkpoint checkpoint() const { return {revision_, history_.parts()}; }
  /// @throws Error where no edits of a structure like this one lead there
  void demand_reachable(const Checkpoint& checkpoint) const;
  /// Continues there. @pre no edit was made, as demand_reachable()
  void begin_at(Checkpoint checkpoint);

  /// @param places  asked by HoldNode
  /// @returns with warnings of gravity that nothing feels and of releases of what nothing holds
  /// or loads
  /// @throws Error with field "edits[i]....": as beams::validate, kOutOfRange, kInvalidArgument,
  /// kFailedPrecondition (nothing to undo); Error{kFailedPrecondition, "expected_revision"};
  /// nothing has changed
  EditReceipt apply(const std::vector<BeamEdit>& edits, std::optional<Revision> expected,
                    const Places& places, const Author& author = {}) {
    return commit(prepare(edits, expected, places, author));
  }
  /// apply() in two parts, as LinkageDocument has them.
  using Prepared = PreparedEdits<History>;
  [[nodiscard]] Prepared prepare(const std::vector<BeamEdit>& edits,
                                 std::optional<Revision> expected, const Places& places,
                                 const Author& author = {}) const;
  EditReceipt commit(Prepared&& prepared);

  [[nodiscard]] Revision revision() const { return revision_; }
  [[nodiscard]] const std::shared_ptr<const BeamConditions>& conditions() const {
    return history_.now();
  }
  /// Under the conditions that it came with.
  [[nodiscard]] const beams::BeamModel& model() const { return model_; }
  [[nodiscard]] std::size_t undo_count() const { return history_.undo_count(); }
  [[nodiscard]] std::size_t redo_count() const { return history_.redo_count(); }

 private:
  class Request;

  const beams::BeamModel model_;
  const BeamLimits limits_;
  History history_;
  Revision revision_ = 0;
};

}  // namespace limber::session
