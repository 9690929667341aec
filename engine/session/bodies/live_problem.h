#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/job.h"
#include "engine/reduced/layered_kinematics.h"
#include "engine/reduced/reduced_model.h"
#include "engine/session/bodies/edit_batch.h"
#include "engine/session/bodies/full_body.h"
#include "engine/session/bodies/keyframe_targets.h"
#include "engine/session/bodies/mode_chooser.h"
#include "engine/session/bodies/motion_check.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"

namespace limber::session {

/// Sites are never forgotten by a model's kinematics. Past so many, and mostly unused, they are
/// made anew.
struct SiteLimits {
  int sites = 20000;
  std::size_t nodes = 16'000'000;  // that their groups name together
};

/// Terms of a scene's problem that never change.
struct ProblemTerms {
  int frame_count = 0;
  int mode_count = 0;  // elastic modes that swing, r without rigid unknowns
  scene::MaterialOptimisation material;
};

/// z-hat = S z, R x N, of a motion z, r x N: `motion` itself where S is the identity, else in
/// `work`.
[[nodiscard]] Eigen::Ref<const Eigen::MatrixXd> mixed_motion(const spacetime::Material& material,
                                                             const Eigen::MatrixXd& motion,
                                                             Eigen::MatrixXd& work);

/// The warm solver of a session, the material it has fitted so far and the sites its constraints
/// need. Driven by one thread.
class LiveProblem {
 public:
  LiveProblem(std::shared_ptr<const reduced::ReducedModel> model,
              std::shared_ptr<const reduced::BaseMotion> base, TargetFrame targets,
              std::unique_ptr<KeyframeTargets> keyframe_targets, ProblemTerms terms,
              spacetime::SolverOptions options, SiteLimits limits = {});

  /// A new, cold solver of what `whole` says.
  void start(const EditBatch& whole);
  /// Before start(): what `other`, of the same modes, has fitted.
  void take_fitted(const LiveProblem& other);
  /// Passes edits on; a mere move stays a mere move. If it throws, the solver and the document no
  /// longer agree: start().
  void apply(const EditBatch& batch);

  [[nodiscard]] bool started() const { return solver_.has_value(); }
  [[nodiscard]] spacetime::Solver& solver() { return *solver_; }
  [[nodiscard]] int site_count() const { return site_count_; }

  /// The material the solver has now; shared, never changed.
  [[nodiscard]] const std::shared_ptr<const spacetime::Material>& material() const {
    return material_;
  }
  /// That of the scene, where optimisation starts.
  [[nodiscard]] const std::shared_ptr<const spacetime::Material>& initial_material() const {
    return initial_;
  }
  /// Another fitted material; the solver keeps its z. Ends an unfinished fit, also where the
  /// material is the same: its motion is of another problem.
  void set_material(std::shared_ptr<const spacetime::Material> material);
  void reset_material() { set_material(initial_); }
  /// mu E_s of material().
  [[nodiscard]] double column_energy() const;
  [[nodiscard]] scene::MaterialVariables variables() const { return variables_; }
  [[nodiscard]] double frames_per_second() const { return frames_per_second_; }
  /// A material optimisation of the present problem from the solver's motion and material(). One
  /// that begins with the scene's own material takes its slow steps first.
  [[nodiscard]] spacetime::MaterialSolver material_solver(
      spacetime::MaterialOptions::MotionLimit limit = {}) const;
  /// The scene allows higher frequencies than those that keep motions quiet.
  [[nodiscard]] bool allows_high_frequencies() const;
  /// A fit that an edit has interrupted where it was still above its start: material_solver() goes
  /// on from here until set_material() is called or the variables change.
  void keep_unfinished(const spacetime::MaterialSolver& fit, int steps);

  /// Selects the kinematics of the solver's displacements; keeps its motion, renews its values.
  void use(reduced::LayeredKinematics::Level level);
  /// Makes the full map where there is none; before use(kFull).
  void provide_full(const std::function<std::unique_ptr<reduced::FullKinematics>()>& make);
  /// Corrects the reduced model by the full map at the solver's motion, which is taken up again.
  void anchor(spacetime::Known known);
  /// See reduced::LayeredKinematics; take the solver's motion up again after either.
  [[nodiscard]] reduced::LayeredKinematics::Corrections take_corrections();
  void give_back(reduced::LayeredKinematics::Corrections corrections);
  /// See reduced::LayeredKinematics; the full map must be there.
  void heed(const Cancellation& cancellation) { kinematics_->heed(cancellation); }
  /// See reduced::FrameShift; null: none, nor anchors. Take the solver's motion up again after it.
  void set_shift(std::shared_ptr<const reduced::FrameShift> shift);
  [[nodiscard]] const std::shared_ptr<const reduced::FrameShift>& shift() const { return shift_; }
  /// Frames of constraints and keyframes, in any order.
  [[nodiscard]] std::vector<HeldFrame> held_frames() const;

  /// q of all frames of a motion (z, r x N) with a material by the reduced model, h x N.
  void model_coordinates(const spacetime::Material& material, const Eigen::MatrixXd& motion,
                         Eigen::MatrixXf& q) const;
  /// The same as they are shown, with the shift: h' x N.
  void coordinates(const spacetime::Material& material, const Eigen::MatrixXd& motion,
                   Eigen::MatrixXf& q) const;
  /// Some columns of these. @param motion  of the span's frames alone
  void coordinates(const spacetime::Material& material, const Eigen::MatrixXd& motion,
                   spacetime::FrameSpan frames, Eigen::MatrixXf& q) const;
  /// How far a motion (q, h x N) misses the keyframes.
  [[nodiscard]] KeyframeMiss keyframe_miss(const Eigen::MatrixXd& basis,
                                           const Eigen::MatrixXf& q) const {
    return keyframe_targets_->miss(keyframes_, basis, q);
  }
  /// The present problem for any number of modes. @param dynamics  as edited
  [[nodiscard]] ModeProblem mode_problem(const scene::Dynamics& dynamics) const;
  [[nodiscard]] bool has_keyframes() const { return !keyframes_.empty(); }
  /// The part of the keyframes' poses beyond the modes; null: none.
  [[nodiscard]] const std::shared_ptr<const reduced::AddedPoses>& added() const { return added_; }
  /// A material was fitted, or may be brought back by undo.
  [[nodiscard]] bool has_fitted() const {
    return material_ != initial_ || unfinished_.has_value() || !fitted_.empty();
  }
  /// Targets and frames that a motion of the present problem is checked at; without the motion.
  [[nodiscard]] CheckRequest check_request() const;

 private:
  struct Unfinished {
    spacetime::Material material;
    Eigen::MatrixXd motion;
    int steps = 0;
  };
  struct Held {
    Eigen::Vector3d origin;  // taken off targets [scene units]
    std::shared_ptr<const reduced::Site> site;
    std::optional<scene::Constraint> velocity;  // as it was set; its frames are those of a rate
    std::optional<scene::Constraint> local;     // as it was set, where it has a reach
    int frames = 1;                             // that it is held in
  };

  /// A target of the scene in the solver's terms: [m], of a velocity [m/frame].
  [[nodiscard]] Eigen::Vector3d map_target(const Eigen::Vector3d& target, const Held& held) const;
  /// Velocities are per second, the solver's per frame.
  void set_frame_rate(double frames_per_second);
  void set_ends(const EndsChange& ends);
  void set(const scene::Constraint& constraint);
  [[nodiscard]] const Held& held(spacetime::ConstraintId of_solver) const {
    return held_.at(constraint_of(of_solver));
  }
  void remove(std::uint64_t id, int frames, int from = 0);
  /// Sets all that depends on the frame rate or the ends: velocities, and constraints' range.
  void set_timed();
  void set_keyframes(std::vector<scene::Keyframe> keyframes);
  /// From projected_, the timeline and the dynamics of the scene.
  bool set_added();
  void note_site(int site, std::size_t nodes);
  [[nodiscard]] bool mostly_unused_sites() const;
  void make_solver(const spacetime::Timeline& timeline);
  /// Load of the base motion, on the modes that are solved for; empty: none. r x N
  [[nodiscard]] Eigen::MatrixXd load() const;
  /// As dynamics_ says.
  void set_dynamics();
  [[nodiscard]] bool is_fitted(const spacetime::Material& material) const;
  /// The scene's own. @param is_fitted  another one is in use
  [[nodiscard]] std::shared_ptr<const spacetime::Material> mapped_material(bool is_fitted) const;
  /// Sets new costs of control forces for the same modes.
  void set_forces(std::shared_ptr<const spacetime::Material> initial);
  void enter_epoch(std::uint64_t epoch);
  void shed_sites();

  std::shared_ptr<const reduced::ReducedModel> model_;
  std::shared_ptr<const reduced::BaseMotion> base_;
  TargetFrame targets_;
  std::unique_ptr<KeyframeTargets> keyframe_targets_;
  std::vector<scene::Keyframe> keyframes_;             // that the solver has
  std::map<std::uint64_t, KeyframeTarget> projected_;  // the same, as it has them
  std::shared_ptr<const reduced::AddedPoses> added_;
  ProblemTerms terms_;
  std::shared_ptr<const spacetime::Material> initial_, material_;
  std::optional<Unfinished> unfinished_;
  double frames_per_second_ = 0;
  scene::Dynamics dynamics_;
  scene::End first_end_ = scene::End::kFree;
  scene::MaterialVariables variables_ = scene::MaterialVariables::kMotion;
  std::uint64_t epoch_ = 0;
  static constexpr std::size_t kMaxEpochs = 64;
  std::map<std::uint64_t, std::shared_ptr<const spacetime::Material>> fitted_;  // of epochs left
  spacetime::SolverOptions options_;
  std::shared_ptr<reduced::LayeredKinematics> kinematics_;
  std::shared_ptr<const reduced::FrameShift> shift_;
  SiteLimits limits_;
  int site_count_ = 0;
  std::size_t site_nodes_ = 0;
  std::map<std::uint64_t, Held> held_;
  std::optional<spacetime::Solver> solver_;
};

}  // namespace limber::session
