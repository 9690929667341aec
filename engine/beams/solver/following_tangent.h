#pragma once

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/structure/elastic.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams::detail {

/// The derivative of what is out of balance by the free unknowns, with what following loads add as
/// their nodes turn: not symmetric.
class FollowingTangent {
 public:
  explicit FollowingTangent(const BeamStructure& structure);

  /// @returns whether it is regular, and finite
  [[nodiscard]] bool factor(const BeamState& state, const NodeLoads& loads);
  /// By free unknowns, with the last factors.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) {
    return factors_.solve(right);
  }
  /// Of the determinant. It changes where equilibria end or divide (divergence), not where a
  /// structure begins to flutter, which masses decide.
  [[nodiscard]] int sign() { return factors_.signDeterminant() < 0 ? -1 : 1; }
  [[nodiscard]] const Stiffness& stiffness() const { return stiffness_; }

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  void add_loads(const BeamState& state, const NodeLoads& loads,
                 std::vector<Eigen::Triplet<double>>& entries) const;

  const BeamStructure& structure_;
  Stiffness stiffness_;
  Eigen::SparseLU<Matrix> factors_;
};

/// Newton's method on forces and moments, from a state that is nearly in balance. Changes state and
/// report's residual and counts. @returns whether it balances to `tolerance`; else the state is as
/// it was
[[nodiscard]] bool balance_following(const BeamStructure& structure, const NodeLoads& loads,
                                     double tolerance, const JobContext& context, BeamState& state,
                                     BeamReport& report);

}  // namespace limber::beams::detail
