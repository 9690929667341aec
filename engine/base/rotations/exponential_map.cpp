#include "engine/base/rotations/exponential_map.h"

#include "engine/base/rotations/exponential_entries.h"

namespace limber::rotations {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& theta) {
  Eigen::Matrix3d result;
  result << 0, -theta.z(), theta.y(), theta.z(), 0, -theta.x(), -theta.y(), theta.x(), 0;
  return result;
}

Eigen::Matrix3d exponential_minus_identity(const Eigen::Vector3d& theta) {
  Eigen::Matrix3d result;
  exponential_entries(exponential_coefficients(theta.squaredNorm()), theta.data(), result.data());
  return result;
}

Eigen::Matrix3d exponential(const Eigen::Vector3d& theta) {
  return exponential_minus_identity(theta) + Eigen::Matrix3d::Identity();
}

Eigen::Matrix<double, 9, 3> exponential_derivative(const Eigen::Vector3d& theta) {
  Eigen::Matrix<double, 9, 3> result;
  const auto k = exponential_coefficients(theta.squaredNorm());
  exponential_derivative_entries<0>(k, theta.data(), result.data());
  exponential_derivative_entries<1>(k, theta.data(), result.data() + 9);
  exponential_derivative_entries<2>(k, theta.data(), result.data() + 18);
  return result;
}

Eigen::Matrix3d exponential_derivative(const Eigen::Vector3d& theta,
                                       const Eigen::Vector3d& direction) {
  const Eigen::Matrix<double, 9, 1> result = exponential_derivative(theta) * direction;
  return Eigen::Map<const Eigen::Matrix3d>(result.data());
}

template <class T>
void exponential_batch(int count, const T* theta, std::ptrdiff_t theta_stride, T* rotation,
                       std::ptrdiff_t rotation_stride) {
  constexpr int kWidth = static_cast<int>(Pack<T>::size());
  const auto item = [&]<class V>(int i, const V* t) {
    V entries[9];
    exponential_entries(exponential_coefficients<V>(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]), t,
                        entries);
    for (int e = 0; e < 9; ++e) {
      if (e % 4 == 0) entries[e] += T(1);
      if constexpr (std::is_same_v<V, T>) {
        rotation[e * rotation_stride + i] = entries[e];
      } else {
        entries[e].copy_to(rotation + e * rotation_stride + i, stdx::element_aligned);
      }
    }
  };
  int i = 0;
  for (; i + kWidth <= count; i += kWidth) {
    Pack<T> t[3];
    for (int c = 0; c < 3; ++c) t[c].copy_from(theta + c * theta_stride + i, stdx::element_aligned);
    item(i, t);
  }
  for (; i < count; ++i) {
    const T t[3] = {theta[i], theta[theta_stride + i], theta[2 * theta_stride + i]};
    item(i, t);
  }
}

template void exponential_batch<double>(int, const double*, std::ptrdiff_t, double*,
                                        std::ptrdiff_t);
template void exponential_batch<float>(int, const float*, std::ptrdiff_t, float*, std::ptrdiff_t);

}  // namespace limber::rotations
