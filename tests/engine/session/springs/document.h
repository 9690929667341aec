#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "engine/session/core/edit_request.h"
#include "engine/session/core/snapshot_history.h"
#include "engine/session/core/values.h"
#include "tests/engine/session/springs/chain.h"

namespace limber::session::springs {

/// Holds the node at this position, whether it was pinned before or not.
struct MovePin {
  int node = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // [m]
};
/// In place of the node's load; zero: none.
struct SetLoad {
  int node = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // [N]
};
struct ReleasePin {
  int node = 0;
};
using SpringEdit = std::variant<MovePin, SetLoad, ReleasePin, Undo, Redo>;

/// A chain's conditions under edits. Not thread-safe, solves nothing. A request of edits is applied
/// whole or not at all, is one revision, and one step of undo.
class SpringDocument {
  using History = SnapshotHistory<Conditions>;

 public:
  /// @throws Error as validate
  explicit SpringDocument(Chain chain);

  /// Edits in two parts: prepare() works on a copy beside readers, commit() takes a moment.
  using Prepared = PreparedEdits<History>;
  /// @throws Error with field "edits[i]....": kOutOfRange, kInvalidArgument, kFailedPrecondition
  /// (nothing to undo); Error{kFailedPrecondition, "expected_revision"}; nothing has changed
  [[nodiscard]] Prepared prepare(const std::vector<SpringEdit>& edits,
                                 std::optional<Revision> expected) const;
  EditReceipt commit(Prepared&& prepared);

  [[nodiscard]] Revision revision() const { return revision_; }
  [[nodiscard]] const Chain& chain() const { return chain_; }
  [[nodiscard]] const std::shared_ptr<const Conditions>& conditions() const {
    return history_.now();
  }

 private:
  class Request;

  const Chain chain_;
  History history_;
  Revision revision_ = 0;
};

}  // namespace limber::session::springs
