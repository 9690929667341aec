#pragma once

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <optional>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/structure/elastic.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams::detail {

/// The derivative of the imbalance by the free unknowns, with the terms of following loads as their
/// nodes turn: not symmetric.
class FollowingTangent {
 public:
  explicit FollowingTangent(const BeamStructure& structure);

  /// @returns whether it is regular, and finite
  [[nodiscard]] bool factor(const BeamState& state, const NodeLoads& loads);
  /// By free unknowns, with the last factors.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) {
    if (right.size() == 0) return right;
    return factors_.solve(right);
  }
  /// In how many directions a structure diverges that rests at a state: eigenvalues of the tangent
  /// whose real parts are negative. Not whether it flutters, which masses decide. None where that
  /// is not judged: the tangent is not finite, or too large for all eigenvalues while its symmetric
  /// part is not positive definite (which would suffice).
  [[nodiscard]] std::optional<int> diverging(const BeamState& state, const NodeLoads& loads,
                                             const JobContext& context);
  [[nodiscard]] const Stiffness& stiffness() const { return stiffness_; }

 private:
  using Matrix = Eigen::SparseMatrix<double>;
  void add_spread_loads(const BeamState& state, const NodeLoads& loads,
                        std::vector<Eigen::Triplet<double>>& entries) const;
  void add_loads(const BeamState& state, const NodeLoads& loads,
                 std::vector<Eigen::Triplet<double>>& entries) const;

  [[nodiscard]] Matrix full(const BeamState& state, const NodeLoads& loads);

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
