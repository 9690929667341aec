#pragma once

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "engine/base/numerics/block_ldlt.h"
#include "engine/rods/linkage/length_pattern.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/solver/condensed_solver.h"

namespace limber::rods::detail {

/// Direct solver for a linkage's unknowns and the rest lengths of its segments together,
///
///   [ H    B ] [ x ]
///   [ B^T  C ] [ L ],
///
/// by the condensed solver for chains. The condensed chains couple each length with the joints near
/// it only. Lengths are grouped to more nodes of the joints' block system, so that nothing is
/// dense.
class LengthSystem {
 public:
  explicit LengthSystem(const LinkageModel& model);

  /// As CondensedSolver::set_pinned, set_shift_weights.
  void set_pinned(const std::vector<int>& unknowns) { solver_.set_pinned(unknowns); }
  void set_shift_weights(const Eigen::VectorXd& weights) { solver_.set_shift_weights(weights); }

  /// Factors the matrix with its diagonal shifted, by shift * length_weight for lengths.
  /// @param mixed  B and C, without rows of pinned unknowns
  /// @param held   of each length: 1 stays as it is, a solution has 0 there
  /// @returns whether all of it is positive
  [[nodiscard]] bool factor(const CondensedMatrix& matrix,
                            const LinkageDerivatives::ByLengths& mixed, double shift,
                            double length_weight, const std::vector<char>& held);
  /// With the last factor; the right-hand side is zero for pinned unknowns.
  void solve_in_place(LinkageVector& x);

 private:
  /// Place of a length in the block system.
  struct Slot {
    int node;
    int entry;
  };
  void make_groups();
  void fill_joints();
  void fill_lengths(double shift_of_length);
  void fill_length(int segment, const Eigen::VectorXd& at_joints, const Eigen::VectorXd& chains,
                   double shift_of_length);
  /// Adds to the entry of two different nodes, or to the lower triangle of one.
  void add(Slot row, Slot column, double value);

  const LinkageModel& model_;
  CondensedSolver solver_;
  LengthPattern pattern_;
  std::vector<Slot> slots_;                       // of lengths
  std::vector<int> filled_;                       // lengths in each group
  std::map<std::pair<int, int>, int> couplings_;  // of nodes, the smaller one first
  std::vector<int> chain_couplings_;              // of chains between joints, else -1
  BlockLdlt blocks_;
  LinkageDerivatives::ByLengths mixed_;  // of the last factor, without columns of held lengths
  std::vector<char> held_;
  std::vector<double> work_;
};

}  // namespace limber::rods::detail
