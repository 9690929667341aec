#include "tests/engine/session/springs/document.h"

#include <fmt/format.h>

#include <cstddef>
#include <utility>

namespace limber::session::springs {

/// One request running on a copy of the history.
class SpringDocument::Request {
 public:
  explicit Request(const SpringDocument& document)
      : chain_(document.chain_), history_(document.history_) {}

  /// @throws Error with a field of the edit
  void apply(const SpringEdit& edit) {
    std::visit([this](const auto& what) { take(what); }, edit);
    ++edits_;
  }
  [[nodiscard]] std::vector<scene::Issue> take_warnings() { return std::move(warnings_); }

  History finish() {
    close_step();
    return std::move(history_);
  }

 private:
  void take(const MovePin& move) {
    demand_node(chain_, move.node, "node");
    demand_finite(move.position, "position");
    changed().pins[move.node] = move.position;
  }
  void take(const SetLoad& set) {
    demand_node(chain_, set.node, "node");
    demand_finite(set.force, "force");
    changed().loads[set.node] = set.force;
    if (set.force.isZero(0)) changed().loads.erase(set.node);
  }
  void take(const ReleasePin& release) {
    demand_node(chain_, release.node, "node");
    if (changed().pins.erase(release.node) > 0) return;
    warnings_.push_back({scene::Issue::Severity::kWarning, fmt::format("edits[{}].node", edits_),
                         fmt::format("node {} is not pinned; nothing was released", release.node)});
  }
  void take(const Undo&) {
    close_step();
    history_.undo();
  }
  void take(const Redo&) {
    close_step();
    history_.redo();
  }

  /// What the next step of undo will hold.
  Conditions& changed() {
    if (!step_) step_ = *history_.now();
    return *step_;
  }
  void close_step() {
    if (!step_) return;
    history_.step_to(*std::exchange(step_, {}), kUndoDepth, kUndoBytes, [](const Conditions& c) {
      return (c.pins.size() + c.loads.size()) * kBytesOfEntry;
    });
  }

  static constexpr int kUndoDepth = 1000;
  static constexpr std::size_t kUndoBytes = std::size_t{64} << 20, kBytesOfEntry = 64;

  const Chain& chain_;
  History history_;
  std::optional<Conditions> step_;  // with the edits since the last step
  std::size_t edits_ = 0;           // taken
  std::vector<scene::Issue> warnings_;
};

SpringDocument::SpringDocument(Chain chain)
    : chain_(std::move(chain)), history_(chain_.conditions) {
  validate(chain_);
}

SpringDocument::Prepared SpringDocument::prepare(const std::vector<SpringEdit>& edits,
                                                 std::optional<Revision> expected) const {
  return prepare_edits(edits, expected, revision_, [&] { return Request(*this); });
}

EditReceipt SpringDocument::commit(Prepared&& prepared) {
  return commit_edits(prepared, history_, revision_);
}

}  // namespace limber::session::springs
