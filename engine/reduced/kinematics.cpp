#include "engine/reduced/kinematics.h"

#include <algorithm>

namespace limber::reduced {

void Kinematics::curvature(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                           std::span<const SiteQuery> queries,
                           const Eigen::Ref<const Eigen::Matrix3Xd>& multipliers,
                           Eigen::MatrixXd& out) const {
  const Eigen::Index size = z.rows();
  out.setZero(size, size * z.cols());
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd above, below;
  Eigen::MatrixXd probe = z;
  const double step = 6e-6 * std::max(1.0, z.size() > 0 ? z.cwiseAbs().maxCoeff() : 0.0);
  for (Eigen::Index k = 0; k < size; ++k) {
    probe.row(k) = z.row(k).array() + step;
    evaluate(frames, probe, queries, u, &above);
    probe.row(k) = z.row(k).array() - step;
    evaluate(frames, probe, queries, u, &below);
    probe.row(k) = z.row(k);
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const auto query = static_cast<Eigen::Index>(i);
      out.col(size * queries[i].column + k).noalias() +=
          (above.middleRows<3>(3 * query) - below.middleRows<3>(3 * query)).transpose() *
          multipliers.col(query) / (2 * step);
    }
  }
  for (Eigen::Index column = 0; column < z.cols(); ++column) {
    auto block = out.middleCols(size * column, size);
    block = (0.5 * (block + block.transpose())).eval();
  }
}

}  // namespace limber::reduced
