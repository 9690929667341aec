#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "engine/scene/embedding/surface_points.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/change_steps.h"
#include "engine/session/bodies/changes.h"
#include "engine/session/bodies/constraint_rules.h"
#include "engine/session/bodies/edit.h"
#include "engine/session/bodies/keyframe_set.h"

namespace limber::session {

struct DocumentLimits {
  int undo_depth = 1000;                            // requests that can be undone, >= 0
  int max_constraints = 4096;                       // >= 0
  std::size_t undo_bytes = std::size_t{256} << 20;  // kept for undo; the newest step always is
  std::size_t max_nodes = 4'000'000;                // named by all constraints together

  void validate() const;
};

/// Checks of a document on a scene besides those of scene::validate(): constraints, ends, dynamics
/// and model sizes that no edit or build accepts. The first error of each member.
[[nodiscard]] std::vector<scene::Issue> document_issues(const scene::Scene& scene);

/// A scene under edits: what the session's answers are made of. Not thread-safe, solves nothing,
/// copies no mesh.
///
/// A request of edits is applied whole or not at all and is one revision and one step of undo. Undo
/// and redo are edits too: they make new revisions. Inside a request, an Undo or Redo ends the step
/// begun by the edits before it.
class Document {
 public:
  /// @throws Error with a field of the scene ("constraints[3].frame") for constraints, ends or
  /// dynamics that an edit
  ///   could not have made either
  explicit Document(scene::Scene scene, DocumentLimits limits = {});

  /// @param touched  what may have changed is added to it
  /// @throws Error{...} with field "edits[i]....", Error{kFailedPrecondition, "expected_revision"};
  /// nothing has changed
  EditReceipt apply(const std::vector<BodyEdit>& edits, std::optional<Revision> expected,
                    Touched& touched, const Author& author = {});

  /// Does what the first such edits take long for: where points of surfaces are in the mesh. For
  /// any thread, while others use the document.
  void prepare(const std::vector<BodyEdit>& edits) const;
  /// May apply() take longer than a copy of this?
  [[nodiscard]] bool is_long(const std::vector<BodyEdit>& edits) const;
  /// Takes over what edits have made of a copy, and leaves it what there was.
  void exchange_edited(Document& copy);

  /// The result of all edits, with the steps that undo and redo lead to: it replaces the edits.
  /// Names and numbers that were given are not given again.
  struct Checkpoint {
    Revision revision = 0;
    scene::End first_end = scene::End::kFree, last_end = scene::End::kFree;
    scene::Dynamics dynamics;
    MaterialChange material;
    PinPaths pins;
    std::uint64_t last_epoch = 0;
    std::vector<scene::Constraint> constraints;
    std::vector<scene::Keyframe> keyframes;
    std::uint64_t next_constraint = 1, next_keyframe = 1;
    std::uint64_t content = 0, last_content = 0;
    std::vector<ChangeSteps::Step> undo, redo;  // newest last
    std::uint64_t last_step = 0;
  };
  [[nodiscard]] Checkpoint checkpoint() const;
  /// @throws Error where no edits of a scene like this one lead there
  void demand_reachable(const Checkpoint& checkpoint) const;
  /// Continues there. @pre no edit was made, as demand_reachable()
  void begin_at(const Checkpoint& checkpoint);

  [[nodiscard]] Revision revision() const { return revision_; }
  [[nodiscard]] scene::End first_end() const { return first_end_; }
  [[nodiscard]] scene::End last_end() const { return last_end_; }
  [[nodiscard]] const scene::Dynamics& dynamics() const { return dynamics_; }
  [[nodiscard]] const MaterialChange& material() const { return material_; }
  [[nodiscard]] const PinPaths& pins() const { return pins_; }
  [[nodiscard]] const std::map<std::uint64_t, scene::Constraint>& constraints() const {
    return constraints_;
  }
  [[nodiscard]] std::vector<scene::Constraint> constraint_list() const;  // by id
  [[nodiscard]] std::vector<scene::Keyframe> keyframe_list() const { return keyframes_.list(); }
  /// Names what the edits have made of the scene: undo and redo come back to earlier names, any
  /// other request makes a new one.
  [[nodiscard]] std::uint64_t content() const { return content_; }
  [[nodiscard]] std::size_t undo_count() const { return undo_.size(); }
  [[nodiscard]] std::size_t redo_count() const { return redo_.size(); }

  /// The part that edits never change: mesh, materials, fixed nodes, frames, model. Its constraints
  /// and keyframes are empty, its ends, dynamics and base motion are those at opening.
  [[nodiscard]] const std::shared_ptr<const scene::Scene>& unedited() const { return unedited_; }
  /// Of unedited().
  [[nodiscard]] const std::shared_ptr<const scene::SurfacePoints>& surface_points() const {
    return points_;
  }

 private:
  struct Opened;
  struct Request;

  Document(Opened opened, DocumentLimits limits);
  TouchedIds apply_edit(const BodyEdit& edit, Request& request);
  [[nodiscard]] std::vector<scene::Issue> warnings(const std::vector<BodyEdit>& edits,
                                                   const EditReceipt& receipt) const;
  [[nodiscard]] std::vector<scene::Issue> warnings_of_ends() const;
  std::uint64_t add(const scene::Constraint& added_value, Request& request);
  std::uint64_t add(const scene::Keyframe& added_value, Request& request);
  enum class Turn { kUndo, kRedo };
  TouchedIds turn(Turn turn, Whose whose, Request& request);
  [[nodiscard]] StepChoice choice(const Request& request) const;
  TouchedIds take_back(std::size_t age, Request& request);
  void settle(Request& request);
  void step(ChangeSteps& from, ChangeSteps& to, Request& request);
  [[nodiscard]] std::shared_ptr<const ChangeGroup> group_of(const Request& request) const;
  void make(Change change, Request& request);
  void close_step(Request& request);
  Change exchange(Change change);
  // document_checkpoint.cpp:
  void load(const Checkpoint& checkpoint);
  void try_steps(const ChangeSteps& steps);
  void demand_pins(const PinPaths& paths) const;
  void demand_keyframe(const scene::Keyframe& keyframe) const;
  void demand_possible(const Change& change) const;

  void number(scene::Constraint& constraint);
  void demand_one_more() const;
  void demand_room(std::size_t nodes) const;
  void demand_known(std::uint64_t id, const char* field) const;

  DocumentLimits limits_;
  std::shared_ptr<const scene::Scene> unedited_;
  std::shared_ptr<const scene::SurfacePoints> points_;
  ConstraintRules rules_;
  scene::End first_end_, last_end_;
  scene::Dynamics dynamics_;
  MaterialChange material_;
  PinPaths pins_;
  std::uint64_t epochs_ = 0;  // newest given
  std::map<std::uint64_t, scene::Constraint> constraints_;
  KeyframeSet keyframes_;
  std::uint64_t next_id_ = 1;  // never goes back, so that an id is not given twice
  Revision revision_ = 0;
  std::uint64_t content_ = 0, contents_ = 0;  // now; newest given
  std::size_t nodes_ = 0;                     // named by constraints_
  ChangeSteps undo_, redo_;
  std::uint64_t steps_ = 0;  // numbers given
};

}  // namespace limber::session
