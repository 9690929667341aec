#include "engine/reduced/site.h"

namespace limber::reduced {

Eigen::Matrix<double, 3, Eigen::Dynamic> mean_rows(const Eigen::Ref<const Eigen::MatrixXd>& matrix,
                                                   const Site& site) {
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic>;
  Rows rows = Rows::Zero(3, matrix.cols());
  if (site.weights.empty()) {
    for (const int node : site.nodes) rows += matrix.middleRows<3>(3 * Eigen::Index{node});
    return rows / static_cast<double>(site.nodes.size());
  }
  for (std::size_t i = 0; i < site.nodes.size(); ++i)
    rows += site.weights[i] * matrix.middleRows<3>(3 * Eigen::Index{site.nodes[i]});
  return rows;
}

}  // namespace limber::reduced
