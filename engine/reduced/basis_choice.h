#pragma once

#include <Eigen/Core>

#include "engine/base/job.h"
#include "engine/bodies/elastic_body.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/pose_data.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/reduced/training_set.h"

namespace limber::reduced {

/// Fields that a basis is to span, 3n x k; the length of a column says how much it counts.
/// Modes (lambda_1 / lambda_i) and modal derivatives (lambda_1^2 / (lambda_i lambda_j)) of the
/// leading 30 elastic modes, of a free body also of its rotations with them. Fewer modes on meshes
/// of more than 8,000 nodes: numbers in all derivatives together stay below 1.2e7.
[[nodiscard]] Eigen::MatrixXd stvk_fields(const bodies::ElasticBody& body,
                                          const bodies::ModalBasis& basis, const JobContext& job);

/// Columns of W-hat and their second derivatives u_ij in the RS reconstruction. Each is scaled by
/// its root mean square coefficient in the poses `z` (R x S): z_i, and z_i z_j or z_i^2 / 2,
/// relative to the norm `norm` (S). Only the pairs with the largest product of weights are taken:
/// at most 465 (600 for a free body), fewer on large meshes as above.
[[nodiscard]] Eigen::MatrixXd map_fields(const ScaledModes& modes, const FullReconstruction& full,
                                         const Eigen::MatrixXd& z, const Eigen::VectorXd& norm,
                                         const JobContext& job);

struct BasisInput {
  const bodies::ElasticBody& body;
  const bodies::ModalBasis& modal;
  const ScaledModes& modes;
  const FullReconstruction& full;
  const TrainingSet& set;
  const Eigen::MatrixXd& animation;  // 3n x frames, or empty
  const ModelOptions& options;
};

/// B with nested orthonormal columns: the requested number, or enough for cubature to choose from.
struct BasisChoice {
  Eigen::MatrixXd basis;
  PoseData validation;  // the validation poses seen through it
};

/// Also fills in the report what became of the choice.
[[nodiscard]] BasisChoice choose_basis(const BasisInput& input, ModelReport& report,
                                       const JobContext& job);

}  // namespace limber::reduced
