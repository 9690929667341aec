#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <algorithm>
#include <vector>

#include "engine/bodies/tet_mesh.h"

namespace limber::bodies {

/// Which nodes share a tet: the sparsity pattern of every operator on nodes, built once by sorting.
/// Assembles 4 x 4 scalar or 12 x 12 vector element matrices tet by tet, so sums are always in the
/// same order.
class NodeGraph {
 public:
  NodeGraph(const TetNodes& tets, int node_count);

  [[nodiscard]] int node_count() const { return static_cast<int>(starts_.size()) - 1; }
  /// Sorted neighbours of node a, itself included: neighbours()[starts()[a] .. starts()[a + 1]).
  [[nodiscard]] const std::vector<int>& starts() const { return starts_; }
  [[nodiscard]] const std::vector<int>& neighbours() const { return neighbours_; }

  /// n x n, full: the sum of element(tet), an Eigen::Matrix4d in the order of the corners.
  template <class Element>
  [[nodiscard]] Eigen::SparseMatrix<double> assemble_scalar(Element&& element) const {
    Eigen::SparseMatrix<double> result = scalar_pattern();
    for (int e = 0; e < tets_.cols(); ++e) {
      const Eigen::Matrix4d values = element(e);
      for (int b = 0; b < 4; ++b) {
        for (int a = 0; a < 4; ++a) {
          result.valuePtr()[position(tets_(a, e), tets_(b, e))] += values(a, b);
        }
      }
    }
    return result;
  }

  /// 3n x 3n, full: the sum of element(tet), an Eigen::Matrix<double, 12, 12> ordered 3 * corner +
  /// axis.
  template <class Element>
  [[nodiscard]] Eigen::SparseMatrix<double> assemble_vector(Element&& element) const {
    Eigen::SparseMatrix<double> result = vector_pattern();
    for (int e = 0; e < tets_.cols(); ++e) {
      const Eigen::Matrix<double, 12, 12> values = element(e);
      for (int b = 0; b < 4; ++b) {
        const int column = tets_(b, e);
        const std::ptrdiff_t degree = starts_[column + 1] - starts_[column];
        for (int a = 0; a < 4; ++a) {
          // Column 3 * node + axis holds 3 * degree entries; those of node `column` start at 9 *
          // starts.
          const std::ptrdiff_t local = position(tets_(a, e), column) - starts_[column];
          double* block = result.valuePtr() + 9 * std::ptrdiff_t{starts_[column]} + 3 * local;
          for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 3; ++i) block[3 * degree * j + i] += values(3 * a + i, 3 * b + j);
          }
        }
      }
    }
    return result;
  }

  /// Each entry (a, b) of a scalar operator becomes a 3 x 3 multiple of the identity.
  [[nodiscard]] static Eigen::SparseMatrix<double> expand_to_axes(
      const Eigen::SparseMatrix<double>& scalar);

 private:
  [[nodiscard]] Eigen::SparseMatrix<double> scalar_pattern() const;
  [[nodiscard]] Eigen::SparseMatrix<double> vector_pattern() const;
  [[nodiscard]] int position(int row, int column) const {
    const auto first = neighbours_.begin() + starts_[column];
    const auto last = neighbours_.begin() + starts_[column + 1];
    return static_cast<int>(std::lower_bound(first, last, row) - neighbours_.begin());
  }

  TetNodes tets_;
  std::vector<int> starts_;
  std::vector<int> neighbours_;
};

}  // namespace limber::bodies
