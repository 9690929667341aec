#include "engine/bodies/dof_map.h"

#include "engine/base/error.h"

namespace limber::bodies {

DofMap DofMap::of_vectors(int node_count, const std::vector<int>& fixed_nodes) {
  return DofMap(node_count, fixed_nodes, 3);
}

DofMap DofMap::of_scalars(int node_count, const std::vector<int>& fixed_nodes) {
  return DofMap(node_count, fixed_nodes, 1);
}

DofMap::DofMap(int node_count, const std::vector<int>& fixed_nodes, int per_node)
    : free_of_full_(static_cast<std::size_t>(node_count) * per_node, 0) {
  for (const int node : fixed_nodes) {
    LIMBER_DEMAND(node >= 0 && node < node_count);
    for (int axis = 0; axis < per_node; ++axis) free_of_full_[per_node * node + axis] = -1;
  }
  for (int full = 0; full < full_count(); ++full) {
    if (free_of_full_[full] < 0) continue;
    free_of_full_[full] = free_count();
    full_of_free_.push_back(full);
  }
}

Eigen::SparseMatrix<double> DofMap::restrict_matrix(const Eigen::SparseMatrix<double>& full) const {
  LIMBER_DEMAND(full.rows() == full_count() && full.cols() == full_count());
  Eigen::SparseMatrix<double> result(free_count(), free_count());
  result.reserve(full.nonZeros());
  for (int column = 0; column < free_count(); ++column) {
    result.startVec(column);
    for (Eigen::SparseMatrix<double>::InnerIterator entry(full, full_of_free_[column]); entry;
         ++entry) {
      const int row = free_of_full_[entry.row()];
      if (row >= 0) result.insertBack(row, column) = entry.value();
    }
  }
  result.finalize();
  return result;
}

Eigen::MatrixXd DofMap::restrict_rows(const Eigen::Ref<const Eigen::MatrixXd>& full) const {
  LIMBER_DEMAND(full.rows() == full_count());
  return full(full_of_free_, Eigen::all);
}

Eigen::MatrixXd DofMap::expand_rows(const Eigen::Ref<const Eigen::MatrixXd>& free) const {
  LIMBER_DEMAND(free.rows() == free_count());
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(full_count(), free.cols());
  full(full_of_free_, Eigen::all) = free;
  return full;
}

}  // namespace limber::bodies
