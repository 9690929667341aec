#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/pose_data.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/scaled_modes.h"

namespace limber::reduced {

/// Poses and their full RS reconstructions.
struct Snapshots {
  Eigen::MatrixXd z;  // R x S
  Eigen::MatrixXd u;  // 3n x S [m]

  /// Seen through the first `size` columns of a basis.
  [[nodiscard]] PoseData project(const Eigen::MatrixXd& basis) const;
};

/// Training poses where the options leave them open. The more poses, the fewer tets and columns
/// meet a tolerance, down to 2400; beyond 40,000 tets their reconstruction would be most of the
/// build.
[[nodiscard]] int automatic_training_poses(int tet_count);

/// The four sets of a build, drawn from independent random streams of the seed.
struct TrainingSet {
  Snapshots train;       // basis and maps
  Eigen::MatrixXd more;  // R x S', further poses for maps only: never held in full
  Snapshots validation;  // sizes and ridge
  Snapshots test;        // reported errors only
  Snapshots small;       // reported error of the linear regime only
};

[[nodiscard]] TrainingSet make_training_set(const bodies::ElasticBody& body,
                                            const ScaledModes& modes,
                                            const FullReconstruction& full,
                                            const ModelOptions& options, const JobContext& job);

/// Test poses that no build of this seed has drawn for an earlier attempt. attempt >= 1; the first
/// ones are those of the set.
[[nodiscard]] Snapshots further_test_poses(const bodies::ElasticBody& body,
                                           const ScaledModes& modes, const FullReconstruction& full,
                                           const ModelOptions& options, int attempt,
                                           const JobContext& job);

/// The training poses of `set` through `basis`: first those that it was made of, then the others.
/// Only the projection of the latter on the basis is computed, block by block
/// (FullReconstruction::Adjoint), as exactly as models to `tolerance` need.
[[nodiscard]] PoseData project_training(const TrainingSet& set, const ScaledModes& modes,
                                        const FullReconstruction& full,
                                        const Eigen::MatrixXd& basis, double tolerance,
                                        const JobContext& job);

}  // namespace limber::reduced
