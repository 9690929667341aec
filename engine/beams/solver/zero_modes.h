#pragma once

#include <Eigen/Core>
#include <functional>

#include "engine/base/job.h"
#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

/// The softest directions at a state, one after the other, as long as the stiffness vanishes along
/// them but for rounding. Directions are by free unknowns.
struct SoftestModes {
  Eigen::MatrixXd zero;   // columns, orthonormal by weights: the stiffness vanishes along each sum
  Eigen::VectorXd next;   // the softest direction beside them; the last of them after kMaxZeroModes
  double next_value = 0;  // its v^T K v
};
inline constexpr int kMaxZeroModes = 24;

/// By inverse iteration.
/// @param stiffness  assembled
/// @param factor  of it, or of it and a small positive diagonal
/// @param allowance  of a direction v: v^T K v below that size is nothing but rounding
[[nodiscard]] SoftestModes softest_modes(
    const Stiffness& stiffness, const SparseCholesky& factor, const Eigen::VectorXd& weights,
    const std::function<double(const Eigen::VectorXd&)>& allowance, const JobContext& context);

/// Zero modes by the resistance of the material along them.
struct ZeroModes {
  /// It does not resist: a mechanism.
  Eigen::MatrixXd loose;
  /// The material resists, and the forces that the structure carries take back exactly as much. The
  /// state is one of a family of equilibria, such as the planes of an arch of a round rod.
  Eigen::MatrixXd neutral;
  Eigen::VectorXd resistance;  // per neutral direction v: v^T K v of the material alone
};

/// Does a direction turn a node alone that has swung by half a turn (swing_twist.h), and move
/// none? The structure rolls about its own axis there, and its shape is the same.
/// @param direction  by all unknowns
[[nodiscard]] bool rolls_at_half_a_turn(const BeamStructure& structure, const BeamState& state,
                                        const Eigen::VectorXd& direction);

/// @param zero  columns by free unknowns
/// @param material  stiffness of the same structure, assembled with all forces left out
/// @param noise  diagonal by free unknowns: pure rounding
[[nodiscard]] ZeroModes sorted_by_material(const Eigen::MatrixXd& zero, const Stiffness& material,
                                           const Eigen::VectorXd& noise);

}  // namespace limber::beams::detail
