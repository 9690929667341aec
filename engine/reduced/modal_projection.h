#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/tracked_base.h"

namespace limber::reduced {

/// Whose RS coordinates are fitted.
enum class ProjectionTets {
  kCubature,  // of the model's cubature tets, all alike (paper)
  kAll,       // of all tets, by volume
};

/// Whether a projection of keyframes also gives what modes leave of each pose.
enum class ProjectionRest { kNone, kKept };

struct ProjectionOptions {
  ProjectionTets tets = ProjectionTets::kCubature;
  ProjectionRest rest = ProjectionRest::kNone;
  /// Singular values below this share of the largest count as zero, in (0, 1).
  double rank_tolerance = 1e-6;
  /// A sum of modes is no gradient field, so the pose that the fit reconstructs to has other RS
  /// coordinates again. Each correction reconstructs the pose in full and fits the error; one that
  /// increases the error is not taken. >= 0; 0 is the pseudo-inverse of the paper.
  int corrections = 0;

  /// @throws Error{kInvalidArgument} naming the member, its value and the inequality
  void validate() const;
};

struct ModalProjection {
  Eigen::MatrixXd z;  // z-bar, R x K, as ReducedModel documents
  /// K: what the fit leaves of the RS coordinates (less the base motion's), relative; 0 at rest.
  Eigen::VectorXd error;
  int rank = 0;          // of the fit, translations of a free body not counted
  double condition = 0;  // largest over smallest singular value that counts
  /// RS coordinates of all tets that modes (and base motion) leave, 9m x K; with
  /// ProjectionRest::kKept, else empty.
  Eigen::MatrixXf rest;
  Eigen::VectorXd rest_size;  // K: root mean square of these over the volume; empty as these are
  /// The part of the displacements that the RS coordinates themselves do not represent: next to
  /// full turns they follow the turns of their neighbours. 3n x K [m], zero at fixed nodes; without
  /// such poses empty.
  Eigen::MatrixXd beyond;
};

/// The frames of an edit's keyframes, and the motion that is edited.
struct KeyframesOnBase {
  std::vector<int> frames;      // K, ascending, in [0, N)
  Eigen::MatrixXd base_motion;  // 3n x N displacements from rest [m]; as given to base_motion()
};

/// Poses as modal RS coordinates (paper: space-time editing, sections 6.2 and 6.3):
///   z-bar = (Q W-hat)^+ (y - y_base).
/// Translations of a free body, which no RS coordinate sees, follow from the centre of mass. Over a
/// base motion, z-bar is the difference from it.
///
/// Rotations have many logarithms, full turns apart. In a motion, branches are tracked in space and
/// time: each tet may turn by less than half a turn from frame to frame. Keyframes may be far
/// apart. A held body's turns are counted from its fixed nodes in each of them alone, over a base
/// motion also from the base's own turns; the better fit of the modes counts. A free body may turn
/// by less than half a turn from one to the next, over a base motion by that much more or less than
/// the base motion does.
///
/// Immutable and thread-safe. Errors name `poses` (or `poses[k]`), `frames` and `base_motion`.
class ModalProjector {
 public:
  /// @param body, model  kept by reference and must outlive this
  /// @throws Error{kInvalidArgument} for options, and for a body that the model is not of
  ModalProjector(const bodies::ElasticBody& body, const ReducedModel& model,
                 const ProjectionOptions& options = {});
  ~ModalProjector();

  /// @param displacements  3n x N from rest [m], frame by frame
  /// @throws Error{kInvalidArgument} for other sizes or numbers that are not finite,
  /// Error{kCancelled}
  [[nodiscard]] ModalProjection motion(const Eigen::Ref<const Eigen::MatrixXd>& displacements,
                                       const JobContext& job = {}) const;

  /// @param poses  3n x K displacements from rest [m], in the order of time
  /// @throws as motion()
  [[nodiscard]] ModalProjection keyframes(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                          const JobContext& job = {}) const;

  /// The same over a base motion.
  /// @throws as above; Error{kOutOfRange} for frames that the base motion does not have
  [[nodiscard]] ModalProjection keyframes(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                          const KeyframesOnBase& base,
                                          const JobContext& job = {}) const;

  /// A base motion for many calls of keyframes(), which then need not track it from its first frame
  /// on. Must not outlive the projector.
  /// @throws Error{kInvalidArgument} for another size or numbers that are not finite
  [[nodiscard]] TrackedBase track(Eigen::MatrixXd base_motion) const;
  /// @param frames  K, ascending, of the base motion
  [[nodiscard]] ModalProjection keyframes(const Eigen::Ref<const Eigen::MatrixXd>& poses,
                                          const std::vector<int>& frames, TrackedBase& base,
                                          const JobContext& job = {}) const;

  /// Whether keyframes() of some poses is that of each of them: not so for a free body, whose turns
  /// are counted from keyframe to keyframe.
  [[nodiscard]] bool keyframes_are_independent() const;

 private:
  class Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace limber::reduced
