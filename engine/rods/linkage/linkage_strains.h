#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods {

/// How far the rods of a linkage are from their rest, segment after segment.
struct LinkageStrains {
  Eigen::VectorXd axial;  // of every edge: (length - rest length) / rest length
  /// At every vertex between two edges: kappa_1, kappa_2 and the twist, per rest length [1/length].
  /// The rod curves towards kappa_1 d_1 + kappa_2 d_2. 3 x vertices.
  Eigen::Matrix3Xd turning;
};

/// Curvatures are the means that the bending energy's moments belong to: M_1 = lambda_1 kappa_1,
/// whichever form the model has.
[[nodiscard]] LinkageStrains linkage_strains(const LinkageModel& model, const LinkageState& state);

}  // namespace limber::rods
