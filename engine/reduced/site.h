#pragma once

#include <Eigen/Core>
#include <vector>

namespace limber::reduced {

/// A place of a body: a mean of nodes, whose displacement is that of its nodes with these weights.
struct Site {
  std::vector<int> nodes;       // compact ids, one or more
  std::vector<double> weights;  // of each, of either sign, their sum is 1; empty: equal ones

  /// Of node nodes[i].
  [[nodiscard]] double weight(std::size_t i) const {
    return weights.empty() ? 1.0 / static_cast<double>(nodes.size()) : weights[i];
  }
};

/// The site's mean of the rows of its nodes, 3 x columns.
/// @param matrix  3n x columns, x y z of each node in turn
[[nodiscard]] Eigen::Matrix<double, 3, Eigen::Dynamic> mean_rows(
    const Eigen::Ref<const Eigen::MatrixXd>& matrix, const Site& site);

}  // namespace limber::reduced
