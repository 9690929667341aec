#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/base/numerics/sparse_cholesky.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

/// Cables that are as long as at rest within rounding, in order.
[[nodiscard]] std::vector<int> just_taut_cables(const BeamStructure& structure,
                                                const BeamState& state);

/// Cables that are just taut resist one way only. Is there a direction in which none of them is
/// pulled, and nothing else resists?
///
/// With the mean stiffness of both sides, the second-order energy of a direction d is d^T K d + sum
/// k x |x| / 2. The sum is over these cables, x = g^T d their stretch. It vanishes for some d if a
/// vector w >= 0 has B w = w, B = D G^T K^-1 G D with D = diag(sqrt(k / 2)). These cables alone
/// then resist motion against w, and w lets all of them slacken. Two diagonals that brace a bay
/// have one positive and one negative entry there: the bay stands. (Roth and Whiteley, Tensegrity
/// frameworks, 1981, theorem 5.2, with stiffness.)
/// @param stiffness  assembled at the state, positive definite
/// @param factor     of it
/// @param noise      by free unknowns, times squares: energy that is nothing but rounding
/// @returns the direction by free unknowns; nothing where there is none. More than 1000 such cables
/// are judged as if they were slack: if the rest does not stand, a direction in which the first
/// alone slackens
[[nodiscard]] std::optional<Eigen::VectorXd> direction_that_slackens(const BeamStructure& structure,
                                                                     const BeamState& state,
                                                                     const Stiffness& stiffness,
                                                                     const SparseCholesky& factor,
                                                                     const Eigen::VectorXd& noise);

}  // namespace limber::beams::detail
