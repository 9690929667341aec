#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "engine/rods/solver/chain_batches.h"
#include "engine/rods/solver/lanes.h"

namespace limber::rods {

/// The Hessian of a linkage before anything is multiplied out:
///
///   H = sum over chains of P^T A P + joint blocks,   P = (J_start, identity, J_finish)
///
/// with A the chain's own matrix over its 4 n + 3 numbers (half-bandwidth 10). J is 7 x 9: the
/// derivatives of the numbers that a joint determines by the joint's unknowns. Memory is laid out
/// for four chains side by side, so that elements of four equal chains are computed and added as
/// whole vectors. Number `lane` of a group of kChainLanes belongs to batch.chains[lane].
class CondensedMatrix {
 public:
  explicit CondensedMatrix(std::shared_ptr<const ChainBatches> structure);

  [[nodiscard]] const ChainBatches& structure() const { return *structure_; }
  [[nodiscard]] const std::shared_ptr<const ChainBatches>& shared_structure() const {
    return structure_;
  }

  void set_zero();

  /// Band of a batch. Entry (column + d, column) of its chains, 0 <= d <= 10, is at [(column *
  /// kBandHeight + d) * kChainLanes + lane]; column 0 .. 4 n + 2. An element at interior vertex i
  /// adds to the 66 entries of rows and columns 4 (i - 1) .. 4 (i - 1) + 10. Entries past the last
  /// row must stay zero.
  [[nodiscard]] double* band(int batch) {
    return (band_.data() + structure_->batches()[batch].band)->values;
  }
  [[nodiscard]] const double* band(int batch) const {
    return (band_.data() + structure_->batches()[batch].band)->values;
  }

  /// J of one end (0 start, 1 finish) of a batch: entry (row, column) of 7 x 9 at
  /// [(row * kJointSize + column) * kChainLanes + lane].
  [[nodiscard]] double* terminal(int batch, int end) {
    return (terminals_.data() + terminal_offset(batch, end))->values;
  }
  [[nodiscard]] const double* terminal(int batch, int end) const {
    return (terminals_.data() + terminal_offset(batch, end))->values;
  }

  /// A joint's own 9 x 9 block, column-major, of which the lower triangle counts: what the
  /// curvature of terminal edges, springs and loads add.
  [[nodiscard]] double* joint(int index) {
    return joints_.data() + static_cast<std::ptrdiff_t>(index) * 81;
  }
  [[nodiscard]] const double* joint(int index) const {
    return joints_.data() + static_cast<std::ptrdiff_t>(index) * 81;
  }

  /// One entry of one chain's band, row >= column.
  [[nodiscard]] double& entry(int chain, int row, int column);
  void set_terminal(int chain, int end, const Eigen::Matrix<double, 7, 9>& jacobian);

  /// H <- H + factor A. @pre A is of the same state, so that its terminals are the same
  void add(double factor, const CondensedMatrix& matrix);

  /// y = H x in the reduced unknowns.
  void multiply(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y) const;

  /// H itself, both triangles.
  [[nodiscard]] Eigen::SparseMatrix<double> to_sparse() const;

 private:
  [[nodiscard]] static std::size_t terminal_offset(int batch, int end) {
    return (static_cast<std::size_t>(batch) * 2 + static_cast<std::size_t>(end)) * kTerminalSize *
           kJointSize;
  }

  std::shared_ptr<const ChainBatches> structure_;
  std::vector<detail::LaneCell> band_;
  std::vector<detail::LaneCell> terminals_;
  std::vector<double> joints_;
};

}  // namespace limber::rods
