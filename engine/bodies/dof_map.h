#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

namespace limber::bodies {

/// Which unknowns are left once some are held: numbers the free ones without gaps, in the old
/// order.
class DofMap {
 public:
  /// All three axes of `fixed_nodes` (each in [0, node_count), any order) are held; unknowns are 3
  /// * node + axis.
  static DofMap of_vectors(int node_count, const std::vector<int>& fixed_nodes);
  /// One unknown per node, for scalar operators such as the Laplacian.
  static DofMap of_scalars(int node_count, const std::vector<int>& fixed_nodes);

  [[nodiscard]] int full_count() const { return static_cast<int>(free_of_full_.size()); }
  [[nodiscard]] int free_count() const { return static_cast<int>(full_of_free_.size()); }
  /// Per unknown its free index, -1 where it is held.
  [[nodiscard]] const std::vector<int>& free_of_full() const { return free_of_full_; }
  [[nodiscard]] const std::vector<int>& full_of_free() const { return full_of_free_; }

  /// Rows and columns of the free unknowns of a compressed square matrix.
  [[nodiscard]] Eigen::SparseMatrix<double> restrict_matrix(
      const Eigen::SparseMatrix<double>& full) const;
  /// Free rows of a full_count() x k block.
  [[nodiscard]] Eigen::MatrixXd restrict_rows(const Eigen::Ref<const Eigen::MatrixXd>& full) const;
  /// A free_count() x k block with zeros in the held rows.
  [[nodiscard]] Eigen::MatrixXd expand_rows(const Eigen::Ref<const Eigen::MatrixXd>& free) const;

 private:
  DofMap(int node_count, const std::vector<int>& fixed_nodes, int per_node);
  std::vector<int> free_of_full_;
  std::vector<int> full_of_free_;
};

}  // namespace limber::bodies
