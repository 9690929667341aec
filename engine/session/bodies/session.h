#pragma once

#include <Eigen/Core>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/reduced/reduced_model.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/document.h"
#include "engine/session/bodies/edit.h"
#include "engine/session/bodies/mode_choice.h"
#include "engine/session/bodies/model_cache.h"
#include "engine/session/bodies/motion_check.h"
#include "engine/session/bodies/start_comparison.h"
#include "engine/session/core/check.h"
#include "engine/session/core/executor.h"
#include "engine/session/core/listener.h"
#include "engine/session/core/result_header.h"
#include "engine/session/core/step_notes.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// How far final results go.
enum class Exactness {
  kReduced,  // the optimum of the reduced model, shown by it
  kFull,     // of the full rotation-strain map at constrained nodes, frames by full reconstruction
};

struct Geometry;

/// The basis that coordinates of frames are multiplied by. It grows while a session is edited:
/// results keep the one that they are of.
struct ShownBasis {
  std::shared_ptr<const Eigen::MatrixXd> basis;  // B, 3n x h, compact nodes [m], orthonormal
  std::shared_ptr<const Geometry> geometry;      // the same in single precision, as sent to clients
};

/// W-hat: the modes of a material are mixtures of these.
struct CandidateModes {
  Eigen::MatrixXd modes;        // 3 source nodes x R [scene units]: to first order, what z = 1 does
  Eigen::VectorXd frequencies;  // R [Hz], of the scene's material; 0 of rigid motions
};

/// One published iterate: immutable, shared between threads. If the solver threw, the motion is an
/// earlier result's, or rest; the report is empty except for its message.
struct BodyResult : ResultHeader {
  spacetime::SolveReport report;
  Eigen::MatrixXd modal;  // z, r x N, in the modes of `material`
  /// The material of the motion, and that of the scene itself: the same without optimisation. Null
  /// in a failed result that nothing came before.
  std::shared_ptr<const spacetime::Material> material, initial_material;
  /// q, h x N, of the motion with forces alone that the fit of the material began with, maybe in an
  /// earlier revision; null where nothing was fitted.
  std::shared_ptr<const Eigen::MatrixXf> start_of_fit;
  double frames_per_second = 1;  // that it was solved for: report's velocities are per frame
  int material_iterations = 0;   // of the material's optimisation for this revision
  double column_energy = 0;      // mu E_s, part of report.total_energy
  double unit_force_energy = 0;  // control forces, comparable between materials
  /// For a final result: the largest distance of a node from its place in a keyframe [m].
  double max_keyframe_error = 0;
  /// For a final result: power of the motion above half the Nyquist frequency, in [0, 1]
  /// (spacetime/motion_spectrum.h); nothing for a few frames.
  std::optional<double> high_frequency_share;
  /// For a final result: constraints that it does not reach, the worst first.
  std::vector<spacetime::ConstraintMiss> out_of_reach;
  double weight_scale = 1;      // of soft constraints, to meet Scene::constraint_tolerance
  Eigen::MatrixXf coordinates;  // q, h x N (float32, as streamed); displacement [m] = B q
  int first_frame = 0;  // of the first column of coordinates and modal: 0 but in early frames
  std::shared_ptr<const ShownBasis> shown;  // B
  /// Energies, errors and frames are those of the full rotation-strain map; else of the reduced
  /// model.
  bool is_exact = false;
  /// From a coarse model, until the session's own is built (FirstPicture): never final.
  bool is_first_picture = false;
  std::uint64_t cold_request =
      0;  // the newest that was given to solve_cold() and is in it; 0: none
  /// A final result is published again with its check, as an amendment: the same but for sequence,
  /// check, motion_check and a longer message.
  Check check = Check::kNone;
  std::shared_ptr<const MotionCheck> motion_check;  // of kDone; null where it failed (see message)
  /// How many times the session had changed its modes: `modal` is in those of that time.
  int mode_changes = 0;
  /// For a checked final result: a comparison of its modes is running. An amendment without this
  /// follows, or a better final result, unless an edit is quicker.
  bool awaits_modes = false;
  /// The starts that were compared for it; nothing before, or where there was nothing to compare.
  std::optional<StartComparison> starts;
  /// For a checked final result: further starts are being tried. An amendment without this follows,
  /// or a better final result, unless an edit is quicker.
  bool awaits_starts = false;
  /// Whether another result of this revision follows a checked one, unless an edit is quicker.
  [[nodiscard]] bool is_followed() const { return awaits_modes || awaits_starts; }
};

/// The coarse model that was shown until the session's own was built.
struct FirstPictureInfo {
  int modes = 0;          // elastic
  double error_mean = 0;  // of its shapes, relative, on held-out poses
};

/// The result that is published if a solve threw: the motion of `newest`, or rest if there is none.
[[nodiscard]] BodyResult failed_result(const BodyResult* newest, const reduced::ReducedModel& model,
                                       std::shared_ptr<const ShownBasis> shown, int frame_count,
                                       const std::string& reason);

using BodyListener = Listener<BodyResult>;

/// The mesh as the client sent it and how to make its frames from streamed coordinates.
struct Geometry {
  bodies::NodePositions rest;                     // 3 x source nodes, scene units
  bodies::TetNodes tets;                          // source node ids
  Eigen::Matrix<int, 3, Eigen::Dynamic> surface;  // boundary triangles, source node ids, outward
  Eigen::MatrixXf basis;   // 3 source nodes x h, scene units: position = rest + basis q
  std::string basis_hash;  // content hash, hex: same hash, same basis
  /// The basis that this one has grown from: its first columns. Empty: none.
  std::string extended_hash;
  int extended_columns = 0;
  std::vector<std::string> repairs, warnings;  // of the mesh
};

struct SessionOptions {
  Exactness exactness = Exactness::kFull;
  spacetime::SolverOptions solver;
  int undo_depth = 1000;                            // requests that can be undone, >= 0
  int max_constraints = 4096;                       // >= 0
  std::size_t undo_bytes = std::size_t{256} << 20;  // kept for undo; the newest request always is
  std::size_t max_constraint_nodes = 4'000'000;     // named by all constraints together
  /// Bodies of at least so many tets show a first picture while their model is built, >= 0. For
  /// smaller ones it takes a tenth of the build, and that takes less than a second anyway.
  int first_picture_tets = 4000;
  /// If the scene does not give r: how it is chosen, after final exact results; none: it stays
  /// ModelRequest::kDefaultModes.
  std::optional<ModeChoiceOptions> mode_choice;
  /// Whether final exact results are compared with optima from further starts, and which; none:
  /// they are not.
  std::optional<StartSearchOptions> start_search;
};

/// A scene, its model, its edits in order, and its newest result; re-optimises whenever an edit
/// arrives.
///
/// Thread-safe. Edits are validated and numbered synchronously, solved asynchronously: those that
/// arrive while a solve runs are coalesced, the newest revision wins, none is skipped in the final
/// state. A refused edit leaves everything as it was.
class BodySession {
 public:
  /// Validates the scene (throws Error for the first error) and starts building the model on the
  /// executor.
  BodySession(std::string id, scene::Scene scene, SessionOptions options,
              std::shared_ptr<ModelCache> cache, Executor executor,
              std::shared_ptr<BodyListener> listener);
  ~BodySession();  // cancels and waits for the running task

  [[nodiscard]] const std::string& id() const;
  [[nodiscard]] State state() const;
  [[nodiscard]] std::string state_message() const;
  [[nodiscard]] Progress progress() const;
  [[nodiscard]] Revision revision() const;   // newest accepted
  [[nodiscard]] scene::Scene scene() const;  // as edited up to revision(); the mesh included
  /// The same without its base motion, which takes time where pins were edited.
  [[nodiscard]] scene::Scene scene_without_base_motion() const;
  [[nodiscard]] PinPaths pins() const;  // as edited; null: not
  [[nodiscard]] std::vector<scene::Constraint> constraints() const;
  [[nodiscard]] std::vector<scene::Keyframe> keyframes() const;
  /// Mesh, unit and all else that edits never change; without constraints and keyframes.
  [[nodiscard]] std::shared_ptr<const scene::Scene> unedited() const;
  [[nodiscard]] scene::Dynamics dynamics() const;                     // as edited
  [[nodiscard]] scene::MaterialVariables material_variables() const;  // as edited

  /// All or nothing: applies the edits in order as one revision. Allowed while the model is still
  /// being built; takes microseconds, also while work runs.
  /// @param expected  if given, refuse with kFailedPrecondition unless it equals revision()
  /// (optimistic locking)
  /// @throws Error with field "edits[i]....": kNotFound, kAlreadyExists, kOutOfRange,
  /// kInvalidArgument, kLimitExceeded,
  ///   kFailedPrecondition (nothing to undo or redo; the session is closed or has no model)
  /// @param author  the author of the edits, see StepChoice
  EditReceipt edit(const std::vector<BodyEdit>& edits, std::optional<Revision> expected = {},
                   const Author& author = {});
  /// A checkpoint that replaces all edits up to revision(), to begin at it elsewhere.
  [[nodiscard]] Document::Checkpoint checkpoint() const;
  /// @throws Error as Document
  void demand_reachable(const Document::Checkpoint& checkpoint) const;
  /// As if those edits were made now. @throws Error as demand_reachable() and edit();
  /// {kFailedPrecondition} behind the first edit
  void begin_at(const Document::Checkpoint& checkpoint);

  /// Solves the current problem from z = 0. The final result that is there already stays (published
  /// again, with a message) unless this one is better. In state kFailed: tries to build again.
  /// @param request  a number of the caller's, repeated by the results that contain this solve:
  /// a warm one may become final just when this is called
  void solve_cold(std::uint64_t request = 0);
  /// In long motions these frames come early after every edit, like those near the edited
  /// constraints: BodyListener::on_early_frames(). The newest kViews spans count, each to
  /// kEarlyFrames.
  /// @throws Error{kOutOfRange} naming first_frame or frame_count
  void look_at(spacetime::FrameSpan frames);

  /// Stops a running build (state kFailed, until solve_cold()) or solve (a final result with status
  /// kCancelled, which contains every edit accepted so far). The session keeps its newest result;
  /// of a cold solve, the final one from before, which is published again if others came between.
  /// A running choice of modes ends, and is not made again before the constraints change much.
  /// Nothing running: no effect.
  void cancel();
  /// Refuses everything from now on, cancels, and tells the listener kClosed. Returns when no task
  /// runs any more; called by the listener itself, returns at once, and kClosed follows. Results
  /// stay readable.
  void close();

  [[nodiscard]] std::shared_ptr<const BodyResult> newest_result() const;  // null before the first
  [[nodiscard]] std::shared_ptr<const BodyResult> final_result() const;   // newest converged one
  /// Geometry of the newest result; null while building, until there is a first picture.
  [[nodiscard]] std::shared_ptr<const Geometry> geometry() const;
  /// The one whose basis has this hash, if it is among the last few; else null.
  [[nodiscard]] std::shared_ptr<const Geometry> geometry(const std::string& basis_hash) const;
  [[nodiscard]] std::shared_ptr<const reduced::ReducedModel> model() const;  // null while building
  /// Remarks on the model for the user: tolerance missed, mechanisms, sizes other than requested.
  /// Empty while building, or if there is nothing to say.
  [[nodiscard]] std::string model_message() const;
  [[nodiscard]] double build_seconds() const;   // 0 while building
  [[nodiscard]] bool model_from_cache() const;  // false while building
  /// The number of modes, and the reason, as far as it is known now.
  [[nodiscard]] ModeChoice mode_choice() const;
  /// Nothing: there was none.
  [[nodiscard]] std::optional<FirstPictureInfo> first_picture() const;

  /// Positions [scene units], 3 source nodes x frames, of a result: rest + basis q, computed in
  /// double.
  [[nodiscard]] Eigen::MatrixXd positions(const BodyResult& result, int first_frame,
                                          int frame_count) const;

  /// @throws Error{kFailedPrecondition} while building
  [[nodiscard]] CandidateModes candidate_modes() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace limber::session
