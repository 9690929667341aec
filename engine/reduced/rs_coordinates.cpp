#include "engine/reduced/rs_coordinates.h"

#include "engine/base/parallel.h"
#include "engine/reduced/rs_kernel.h"

namespace limber::reduced {

RsVector rs_of_gradient(const Eigen::Matrix3d& gradient) {
  RsVector y;
  rs_of_gradient_entries(gradient.data(), y.data());
  return y;
}

Eigen::Matrix3d linear_gradient(const RsVector& y) {
  Eigen::Matrix3d result;
  rs_linear_gradient(y.data(), result.data());
  return result;
}

Eigen::Matrix3d displacement_gradient(const RsVector& y) {
  double rotation[9];
  Eigen::Matrix3d g;
  rs_gradient_entries(y.data(), rotation, g.data());
  return g;
}

Eigen::Matrix<double, 9, 9> displacement_gradient_derivative(const RsVector& y) {
  Eigen::Matrix<double, 9, 9> result = Eigen::Matrix<double, 9, 9>::Zero();
  double rotation[9], g[9];
  const auto k = rs_gradient_entries(y.data(), rotation, g);
  rs_rotation_column<0>(k, y.data(), result.data());
  rs_rotation_column<1>(k, y.data(), result.data() + 9);
  rs_rotation_column<2>(k, y.data(), result.data() + 18);
  for (int e = 0; e < 9; e += 4) rotation[e] += 1;
  // d (R s): entry (i, j) of s puts column i of R into column j of g.
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 3; ++i) {
      for (int row = 0; row < 3; ++row)
        result(3 * j + row, kStrainEntry[i][j]) += rotation[3 * i + row];
    }
  }
  return result;
}

Eigen::MatrixXd linear_coordinates(const bodies::GradientOperator& gradient,
                                   const std::vector<int>& tets,
                                   const Eigen::Ref<const Eigen::MatrixXd>& u) {
  const int count = static_cast<int>(tets.size());
  Eigen::MatrixXd y(kRsSize * count, u.cols());
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    for (int t = 0; t < count; ++t) {
      y.col(k).segment<kRsSize>(kRsSize * t) = rs_of_gradient(gradient.apply(u.col(k), tets[t]));
    }
  }
  return y;
}

Eigen::MatrixXd linear_coordinates(const bodies::GradientOperator& gradient,
                                   const Eigen::Ref<const Eigen::MatrixXd>& u) {
  Eigen::MatrixXd y(kRsSize * gradient.tet_count(), u.cols());
  parallel_for(u.cols(), 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t k = begin; k < end; ++k) {
      for (int e = 0; e < gradient.tet_count(); ++e) {
        y.col(k).segment<kRsSize>(kRsSize * e) = rs_of_gradient(gradient.apply(u.col(k), e));
      }
    }
  });
  return y;
}

}  // namespace limber::reduced
