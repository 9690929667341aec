#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/beams/refinement/subdivision_choice.h"
#include "engine/session/beams/analysis.h"
#include "engine/session/beams/discretisation_check.h"
#include "engine/session/beams/document.h"
#include "engine/session/core/check.h"
#include "engine/session/core/executor.h"
#include "engine/session/core/listener.h"
#include "engine/session/core/result_header.h"
#include "engine/session/core/step_notes.h"

namespace limber::session {

/// One published shape of a structure of beams: immutable, shared between threads. If the solve
/// failed, no equilibrium was found for the request: the shape is the last one.
struct BeamResult : ResultHeader {
  beams::BeamReport report;  // of a final result: of the attempt
  /// Coordinates (see beam_coordinates), a column a shape: of a final result, the load steps or
  /// shapes of the relaxation towards it; else the current shape. The last column is the
  /// shape.
  std::shared_ptr<const Eigen::MatrixXd> frames;
  /// Analysis of the shape if it is final; null if there was never an equilibrium.
  std::shared_ptr<const BeamAnalysis> analysis;
  /// kPending: it is published again with its `discretisation`. If a tolerance chooses the
  /// elements, final results have it at once.
  Check check = Check::kNone;
  /// The discretisation check of this shape; null if there was none, or while it is pending.
  std::shared_ptr<const DiscretisationCheck> discretisation;
};

using BeamListener = Listener<BeamResult>;

/// A structure of beams, what acts on it, its edits in order, and its newest shape; finds
/// equilibrium again whenever an edit arrives, from the equilibrium there is. The same contract as
/// Session: thread-safe, edits are numbered at once and solved later, a newer edit interrupts a
/// solve, a refused edit leaves everything as it was.
class BeamSession {
 public:
  /// @throws Error as BeamDocument
  /// @param shape  where it begins, of the model's nodes and hinged ends; none: as drawn
  /// @param discretisation  elements per model element; if a tolerance chooses them, intermediate
  /// shapes are published as iterates
  BeamSession(std::string id, beams::BeamModel model, BeamLimits limits, Executor executor,
              std::shared_ptr<BeamListener> listener, std::optional<beams::BeamState> shape = {},
              beams::BeamDiscretisation discretisation = {});
  ~BeamSession();  // cancels and waits for the running task

  [[nodiscard]] const std::string& id() const;
  [[nodiscard]] State state() const;
  [[nodiscard]] Revision revision() const;  // newest accepted
  /// As edited up to revision(), with the temporary loads that it came with: they matter where it
  /// is solved as drawn.
  [[nodiscard]] beams::BeamModel model() const;
  [[nodiscard]] std::shared_ptr<const BeamConditions> conditions() const;

  /// As Session::edit. A node is held where it is only once the newest revision is solved:
  /// {kFailedPrecondition} before.
  /// @param author  the author of the edits, see StepChoice
  EditReceipt edit(const std::vector<BeamEdit>& edits, std::optional<Revision> expected = {},
                   const Author& author = {});
  /// A checkpoint that replaces all edits up to revision(), to begin at it elsewhere.
  /// @throws Error{kFailedPrecondition} while an answer is missing that edits depend on and the
  /// checkpoint does not say: of pushes
  [[nodiscard]] BeamDocument::Checkpoint checkpoint() const;
  /// @throws Error as BeamDocument
  void demand_reachable(const BeamDocument::Checkpoint& checkpoint) const;
  /// As if those edits were made now. @throws Error as demand_reachable() and edit();
  /// {kFailedPrecondition} behind the first edit
  void begin_at(BeamDocument::Checkpoint checkpoint);
  /// Stops a running solve: a final result with status kCancelled, which holds the last
  /// equilibrium.
  void cancel();
  /// Refuses everything from now on, cancels, tells the listener kClosed, and returns when no task
  /// runs any more (called by the listener itself, at once).
  void close();

  [[nodiscard]] std::shared_ptr<const BeamResult> newest_result() const;  // null before the first
  [[nodiscard]] std::shared_ptr<const BeamResult> final_result() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace limber::session
