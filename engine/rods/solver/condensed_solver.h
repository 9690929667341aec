#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "engine/base/numerics/pivot_count.h"
#include "engine/rods/solver/chain_batches.h"
#include "engine/rods/solver/condensed_matrix.h"

namespace limber::rods {

/// Direct solver for Hessians of linkages. Every chain is condensed onto the joints at its ends,
/// four chains at a time; then BlockLdlt factors the joints' system of 9 x 9 blocks.
///
/// Everything that depends on the structure only is done once; factor() and solves allocate
/// nothing. L D L^T without exchanges: an indefinite matrix is factored too and its inertia
/// reported. Results do not depend on the number of threads.
class CondensedSolver {
 public:
  explicit CondensedSolver(std::shared_ptr<const ChainBatches> structure);
  ~CondensedSolver();
  CondensedSolver(CondensedSolver&&) noexcept;
  CondensedSolver& operator=(CondensedSolver&&) noexcept;

  [[nodiscard]] int size() const;

  /// Unknowns that stay as they are: their rows and columns become those of the identity, so that a
  /// solution there is the right-hand side. Replaces the former ones; takes effect with factor().
  /// @throws Error{kOutOfRange} for an unknown that is not there
  void set_pinned(const std::vector<int>& unknowns);

  /// Increase of each diagonal entry by a shift of 1, e.g. masses; size() numbers >= 0. At first 1.
  /// @throws Error{kInvalidArgument} for a wrong size or a negative or not finite number
  void set_shift_weights(const Eigen::Ref<const Eigen::VectorXd>& weights);

  /// Factors H + shift diag(weights).
  /// @pre the matrix has this solver's structure
  /// @returns signs of all pivots, those of pinned unknowns counted as positive
  PivotCount factor(const CondensedMatrix& matrix, double shift = 0);

  /// x <- (H + shift diag(weights))^-1 x with the last factor. Not from several threads at once.
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> x);

  /// The two halves of a solve, with the last factor, for callers that solve for the joints'
  /// unknowns otherwise: those of x become x_J - H_Jc H_cc^-1 x_c, chains' unknowns stay;
  void eliminate_chains(Eigen::Ref<Eigen::VectorXd> x);
  /// then, with solutions for those of joints in x, chains' become H_cc^-1 (x_c - H_cJ x_J).
  void substitute_chains(Eigen::Ref<Eigen::VectorXd> x);
  /// The last factor's condensed matrix of the joints, H_JJ - H_Jc H_cc^-1 H_cJ. Its 9 x 9 blocks
  /// are column-major: of a joint (lower triangle), and by a chain between two joints (rows: its
  /// start).
  [[nodiscard]] const double* condensed_joint(int joint) const;
  [[nodiscard]] const double* condensed_coupling(int chain) const;

  /// For the last factor.
  [[nodiscard]] const PivotCount& pivots() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::rods
