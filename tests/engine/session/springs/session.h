#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/core/executor.h"
#include "engine/session/core/listener.h"
#include "engine/session/core/result_header.h"
#include "engine/session/core/step_notes.h"
#include "tests/engine/session/springs/document.h"

namespace limber::session::springs {

/// One published shape: immutable, shared between threads.
struct SpringResult : ResultHeader {
  Report report;
  /// Of a final result the newest equilibrium, or as drawn; else an iterate. Never null.
  std::shared_ptr<const Shape> shape;
};

using SpringListener = Listener<SpringResult>;

/// A chain of springs that is kept in equilibrium while it is edited. Thread-safe: edits are
/// numbered at once and solved later, a newer edit interrupts a solve, a refused edit changes
/// nothing.
class SpringSession {
 public:
  /// @throws Error as SpringDocument
  SpringSession(std::string id, Chain chain, Executor executor,
                std::shared_ptr<SpringListener> listener);
  ~SpringSession();  // cancels and waits for the running task

  [[nodiscard]] const std::string& id() const;
  [[nodiscard]] State state() const;
  [[nodiscard]] std::string state_message() const;
  [[nodiscard]] Revision revision() const;  // newest accepted
  [[nodiscard]] std::shared_ptr<const Conditions> conditions() const;

  /// @throws Error as SpringDocument::prepare; {kFailedPrecondition} once it is closed
  EditReceipt edit(const std::vector<SpringEdit>& edits, std::optional<Revision> expected = {},
                   const Author& author = {});
  void cancel();
  void close();

  [[nodiscard]] std::shared_ptr<const SpringResult> newest_result() const;  // null before the first
  [[nodiscard]] std::shared_ptr<const SpringResult> final_result() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace limber::session::springs
