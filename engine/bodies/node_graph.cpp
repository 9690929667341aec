#include "engine/bodies/node_graph.h"

#include <cstdint>

#include "engine/base/error.h"

namespace limber::bodies {

NodeGraph::NodeGraph(const TetNodes& tets, int node_count) : tets_(tets) {
  // Counting sort of the directed pairs by their first node, then a small sort per node.
  std::vector<std::int64_t> offsets(static_cast<std::size_t>(node_count) + 1, 0);
  for (int e = 0; e < tets.cols(); ++e) {
    for (int a = 0; a < 4; ++a) {
      LIMBER_DEMAND(tets(a, e) >= 0 && tets(a, e) < node_count);
      offsets[tets(a, e) + 1] += 4;
    }
  }
  for (int a = 0; a < node_count; ++a) offsets[a + 1] += offsets[a];
  std::vector<int> pairs(static_cast<std::size_t>(offsets.back()));
  std::vector<std::int64_t> next(offsets.begin(), offsets.end() - 1);
  for (int e = 0; e < tets.cols(); ++e) {
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b) pairs[next[tets(a, e)]++] = tets(b, e);
    }
  }
  starts_.reserve(offsets.size());
  starts_.push_back(0);
  for (int a = 0; a < node_count; ++a) {
    const auto first = pairs.begin() + offsets[a];
    const auto last = pairs.begin() + offsets[a + 1];
    std::sort(first, last);
    neighbours_.insert(neighbours_.end(), first, std::unique(first, last));
    // Nine values per pair must be addressable by the int indices of Eigen::SparseMatrix.
    if (neighbours_.size() > static_cast<std::size_t>(INT32_MAX / 9)) {
      throw Error(ErrorCode::kLimitExceeded, "mesh", "the mesh is too large for 32-bit matrices");
    }
    starts_.push_back(static_cast<int>(neighbours_.size()));
  }
}

Eigen::SparseMatrix<double> NodeGraph::scalar_pattern() const {
  const int n = node_count();
  Eigen::SparseMatrix<double> result(n, n);
  result.resizeNonZeros(static_cast<Eigen::Index>(neighbours_.size()));
  std::copy(starts_.begin(), starts_.end(), result.outerIndexPtr());
  std::copy(neighbours_.begin(), neighbours_.end(), result.innerIndexPtr());
  std::fill_n(result.valuePtr(), neighbours_.size(), 0.0);
  return result;
}

Eigen::SparseMatrix<double> NodeGraph::vector_pattern() const {
  const int n = node_count();
  Eigen::SparseMatrix<double> result(3 * n, 3 * n);
  result.resizeNonZeros(9 * static_cast<Eigen::Index>(neighbours_.size()));
  int filled = 0;
  for (int b = 0; b < n; ++b) {
    for (int j = 0; j < 3; ++j) {
      result.outerIndexPtr()[3 * b + j] = filled;
      for (int k = starts_[b]; k < starts_[b + 1]; ++k) {
        for (int i = 0; i < 3; ++i) result.innerIndexPtr()[filled++] = 3 * neighbours_[k] + i;
      }
    }
  }
  result.outerIndexPtr()[3 * n] = filled;
  std::fill_n(result.valuePtr(), filled, 0.0);
  return result;
}

Eigen::SparseMatrix<double> NodeGraph::expand_to_axes(const Eigen::SparseMatrix<double>& scalar) {
  LIMBER_DEMAND(scalar.isCompressed());
  Eigen::SparseMatrix<double> result(3 * scalar.rows(), 3 * scalar.cols());
  result.resizeNonZeros(3 * scalar.nonZeros());
  int filled = 0;
  for (int b = 0; b < scalar.cols(); ++b) {
    for (int axis = 0; axis < 3; ++axis) {
      result.outerIndexPtr()[3 * b + axis] = filled;
      for (Eigen::SparseMatrix<double>::InnerIterator entry(scalar, b); entry; ++entry) {
        result.innerIndexPtr()[filled] = 3 * static_cast<int>(entry.row()) + axis;
        result.valuePtr()[filled++] = entry.value();
      }
    }
  }
  result.outerIndexPtr()[3 * scalar.cols()] = filled;
  return result;
}

}  // namespace limber::bodies
