#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/rod_chains.h"
#include "engine/scene/linkage.h"
#include "engine/session/core/check.h"
#include "engine/session/core/executor.h"
#include "engine/session/core/listener.h"
#include "engine/session/core/result_header.h"
#include "engine/session/core/step_notes.h"
#include "engine/session/linkages/design_values.h"
#include "engine/session/linkages/document.h"
#include "engine/session/linkages/recalled_answer.h"
#include "engine/session/linkages/shape.h"
#include "engine/session/linkages/shape_check.h"
#include "engine/session/linkages/statics.h"

namespace limber::session {

struct LinkageGeometry;

/// One published shape of a linkage: immutable, shared between threads. If the solve failed, no
/// equilibrium was found for the request: the shape is the last one along the path, or the one
/// before.
struct LinkageResult : ResultHeader {
  rods::EquilibriumReport report;  // forces [N], lengths in the scene's unit
  double mean_angle = 0;           // [rad]
  /// The equilibria along the path of a final result: one for each of its frames, and what happened
  /// there. Empty where there was none.
  std::vector<rods::DeploymentStep> path;
  /// Coordinates (see LinkageShape), a column a shape: of a final result, the equilibria along the
  /// path to it; else the shape of the iterate. The last column is the shape.
  std::shared_ptr<const Eigen::MatrixXd> frames;
  /// Strains of the same shapes, see LinkageStatics; null while the result is not final.
  std::shared_ptr<const Eigen::MatrixXf> strains;
  /// Makes forces and stresses from coordinates and strains of this result; null while it is not
  /// final.
  std::shared_ptr<const LinkageStatics> statics = {};
  /// For a step of a design, which is never final. Frames are the flat shape and the deployed one,
  /// for the rest lengths of that step; the fields of an equilibrium's report and path are empty.
  std::shared_ptr<const DesignInfo> design = {};
  /// Scales of each segment's section in these shapes (LinkageShape::surface); empty: all 1.
  Eigen::VectorXd section_scales = {};
  /// The shape in full, from which a scene opens again; null while the result is not final.
  std::shared_ptr<const rods::LinkageState> state = {};
  /// Conditions of its equilibrium; null without a state.
  std::shared_ptr<const scene::LinkageConditions> conditions = {};
  /// The requested conditions, as the document's own object; null without a state.
  std::shared_ptr<const scene::LinkageConditions> requested = {};
  /// The same as the solver has them.
  std::shared_ptr<const rods::Conditions> held = {};
  /// The geometry for its number of edges: defines its numbers and makes surfaces of them.
  std::shared_ptr<const LinkageGeometry> geometry = {};
  std::shared_ptr<const LinkageShape> shape = {};
  /// For a final result that was reached: kPending, then published again as kDone with the error of
  /// its edges, unless an edit comes first.
  Check check = Check::kNone;
  /// For kDone; null if the check failed.
  std::shared_ptr<const ShapeCheck> shape_check = {};
  std::string check_failure = {};  // then, why
};

class LinkageListener : public Listener<LinkageResult> {
 public:
  /// A design has begun, made a step, paused, resumed or ended; before that step's result.
  virtual void on_design(const std::shared_ptr<const DesignInfo>&) {}
};

/// Data common to all shapes of a session, until it is cut into more edges.
struct LinkageGeometry {
  std::string hash;                               // same hash, same edges
  int coordinates = 0;                            // of one shape
  std::vector<int> edges;                         // of each segment
  Eigen::Matrix2Xi joints_of_segment;             // 2 x segments, -1: a free end
  std::vector<int> vertex_of_joint;               // of the line mesh
  std::vector<Eigen::Vector2d> outline;           // of the section, on (d_1, d_2)
  Eigen::Matrix<int, 3, Eigen::Dynamic> surface;  // triangles of the swept surface
  int surface_nodes = 0;
  std::vector<rods::RodChain> rods;
  bool mixed_angles = false;  // see rods::LinkageGraph
};

/// A rod linkage, what acts on it, its edits in order, and its newest shape; finds equilibrium
/// again whenever an edit arrives. The same contract as Session: thread-safe, edits are numbered at
/// once and solved later, a refused edit leaves everything as it was.
class LinkageSession {
 public:
  /// Checks the linkage (throws Error as demand_sound) and starts building on the executor.
  /// @param recalled  says that the scene's shape is the answer to the revision that it names. If
  /// the shape balances, it is published as that; edits up to there must be made before the
  /// executor runs
  LinkageSession(std::string id, scene::Linkage linkage, LinkageLimits limits, Executor executor,
                 std::shared_ptr<LinkageListener> listener,
                 std::optional<RecalledAnswer> recalled = {});
  ~LinkageSession();  // cancels and waits for the running task

  [[nodiscard]] const std::string& id() const;
  [[nodiscard]] State state() const;
  [[nodiscard]] std::string state_message() const;
  [[nodiscard]] Revision revision() const;       // newest accepted
  [[nodiscard]] scene::Linkage linkage() const;  // as edited up to revision(), in no shape
  /// Edges per segment are those that the tolerance took, and takes where edits ask for more; else
  /// the scene's.
  [[nodiscard]] bool chose_edges() const;
  /// The same, in the shape of the newest final result if there is one, with the conditions of its
  /// equilibrium. An edit that is not solved yet, or failed, has other conditions.
  [[nodiscard]] scene::Linkage linkage_in_shape() const;
  [[nodiscard]] std::shared_ptr<const scene::LinkageConditions> conditions() const;

  /// As Session::edit; refused while a design is running.
  /// @param author  the author of the edits, see StepChoice
  EditReceipt edit(const std::vector<LinkageEdit>& edits, std::optional<Revision> expected = {},
                   const Author& author = {});
  /// A checkpoint that replaces all edits up to revision(), to begin at it elsewhere.
  /// @throws Error{kFailedPrecondition} while an answer is missing that edits depend on and the
  /// checkpoint does not say: of pins that hold joints where they are,
  /// and of lengths of edges
  [[nodiscard]] LinkageDocument::Checkpoint checkpoint() const;
  /// @throws Error as LinkageDocument
  void demand_reachable(const LinkageDocument::Checkpoint& checkpoint) const;
  /// As if those edits were made now. @throws Error as demand_reachable() and edit();
  /// {kFailedPrecondition} behind the first edit
  void begin_at(LinkageDocument::Checkpoint checkpoint);
  /// Stops a running solve: a final result with status kCancelled, which holds the last
  /// equilibrium. While rest lengths are solved for: the build, which has failed then.
  void cancel();

  // Designs: rest lengths for which the free shape is flat and the one under the present conditions
  // is near to targets or a surface. At most one runs at a time, on the session's task, after
  // earlier edits. Steps are published as results.

  /// One that ends by itself with all constraints kept is taken at once; others leave the session
  /// as it was.
  /// @param tag  of the infos about it
  /// @throws Error as DesignRequest::validate and demand_near; {kFailedPrecondition} before the
  /// session has a shape, while another is running, and with field targets, loads or gravity of
  /// conditions that no derivatives are known under. Errors that only its equilibria show end the
  /// design with DesignEnd::kFailed
  void start_design(DesignRequest request, std::uint64_t tag = 0);
  /// Continues towards another goal. @throws Error as above, and the design continues as it was;
  /// {kFailedPrecondition} where none is running, and so do the next three
  void change_design(const DesignChange& change);
  /// When the running step is done; edits stay refused.
  void pause_design();
  void resume_design();
  /// The session goes back to the shape it had, which is the newest result when this returns; the
  /// best so far can still be taken.
  void stop_design();
  /// The best rest lengths of the newest design become the session's: an edit, which undo takes
  /// back. One that is running ends. While the session has the sizes that taking it brought, it
  /// is the revision that did.
  /// @throws Error{kFailedPrecondition} where there is none to take; as LinkageDocument::apply
  EditReceipt take_design(std::optional<Revision> expected = {});
  [[nodiscard]] NewestDesign newest_design() const;
  /// The newest; null before the first.
  [[nodiscard]] std::shared_ptr<const DesignInfo> design() const;
  /// The design that would be taken; null if there is none.
  [[nodiscard]] std::shared_ptr<const DesignCandidate> best_design() const;

  /// Refuses everything from now on, cancels, tells the listener kClosed, and returns when no task
  /// runs any more (called by the listener itself, at once).
  void close();

  [[nodiscard]] std::shared_ptr<const LinkageResult> newest_result()
      const;  // null before the first
  [[nodiscard]] std::shared_ptr<const LinkageResult> final_result() const;
  [[nodiscard]] std::shared_ptr<const LinkageGeometry> geometry() const;  // null while building
  /// Makes surfaces from coordinates, without the session; null while building.
  [[nodiscard]] std::shared_ptr<const LinkageShape> shape() const;
  /// Statics of the newest final result; null before there is one.
  [[nodiscard]] std::shared_ptr<const LinkageStatics> statics() const;
  /// The swept surface of a shape (coordinates), 3 surface nodes [scene length unit].
  /// @param section_scales  those of its result; empty: all 1
  [[nodiscard]] Eigen::VectorXd surface(const Eigen::Ref<const Eigen::VectorXd>& coordinates,
                                        const Eigen::VectorXd& section_scales = {}) const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace limber::session
