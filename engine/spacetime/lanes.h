#pragma once

#include <Eigen/Core>
#include <type_traits>
#include <utility>

namespace limber::spacetime {

/// Modes are lanes: column i of a lane matrix holds one number per mode, contiguous, so that every
/// loop over modes is a vector loop. The number of rows is r rounded up to kLaneWidth; the spare
/// lanes belong to harmless modes at rest.
using Lanes = Eigen::MatrixXd;

inline constexpr int kLaneWidth = 4;  // doubles of one vector operation

[[nodiscard]] constexpr int padded_lanes(int modes) {
  return (modes + kLaneWidth - 1) / kLaneWidth * kLaneWidth;
}

/// sum_k a_k b_k with four fixed partial sums: vectorises without licence to reorder, hence bitwise
/// repeatable.
[[nodiscard]] inline double lane_dot(const double* a, const double* b, int lanes) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  for (int k = 0; k < lanes; k += kLaneWidth) {
    s0 += a[k] * b[k];
    s1 += a[k + 1] * b[k + 1];
    s2 += a[k + 2] * b[k + 2];
    s3 += a[k + 3] * b[k + 3];
  }
  return (s0 + s2) + (s1 + s3);
}

[[nodiscard]] inline double lane_dot(const Lanes& a, const Lanes& b) {
  return lane_dot(a.data(), b.data(), static_cast<int>(a.size()));
}

/// f(0), ..., f(kCount - 1), each with its number as a constant. For use inside a loop over lanes:
/// an inner loop would keep the compiler from vectorising it.
template <int kCount, class Body>
inline void unrolled(const Body& body) {
  [&]<int... kIndex>(std::integer_sequence<int, kIndex...>) {
    (body(std::integral_constant<int, kIndex>{}), ...);
  }
  (std::make_integer_sequence<int, kCount>{});
}

/// y_k += alpha x_k
inline void lane_axpy(double alpha, const double* __restrict x, double* __restrict y, int lanes) {
  for (int k = 0; k < lanes; ++k) y[k] += alpha * x[k];
}

}  // namespace limber::spacetime
