#include "engine/base/rotations/exponential_map.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "engine/base/rotations/exponential_coefficients.h"

namespace limber::rotations {
namespace {

// sum over k of term(k) x^k in long double: an independent value of the coefficients wherever it
// does not cancel.
long double series(long double x, long double (*term)(int)) {
  long double sum = 0;
  for (int k = 18; k >= 0; --k) sum = sum * x + term(k);
  return sum;
}
long double inverse_factorial(int k) { return 1 / std::tgamma(static_cast<long double>(k + 1)); }
long double sign(int k) { return k % 2 == 0 ? 1 : -1; }

std::array<long double, 4> reference_coefficients(long double n) {
  if (n < 3) {
    const long double x = n * n;
    return {series(x, [](int k) { return sign(k) * inverse_factorial(2 * k + 1); }),
            series(x, [](int k) { return sign(k) * inverse_factorial(2 * k + 2); }),
            series(x, [](int k) { return -sign(k) * (2 * k + 2) * inverse_factorial(2 * k + 3); }),
            series(x, [](int k) { return -sign(k) * (2 * k + 2) * inverse_factorial(2 * k + 4); })};
  }
  const long double s = std::sin(n), c = std::cos(n), n2 = n * n;
  return {s / n, (1 - c) / n2, (n * c - s) / (n2 * n), (2 * c - 2 + n * s) / (n2 * n2)};
}

TEST(RotationsExponential, CoefficientsAreGoodToUlpsUpToPi) {
  const double eps = std::numeric_limits<double>::epsilon();
  double worst[4] = {0, 0, 0, 0};
  for (int i = 0; i <= 20000; ++i) {
    // Half of the samples logarithmic from 1e-12 (where the closed forms have no digit left), half
    // linear to pi.
    const double n =
        i % 2 == 0 ? std::pow(10.0, -12 + 12.4 * i / 20000.0) : std::numbers::pi * i / 20000.0;
    if (n > std::numbers::pi) continue;
    const double squared = n * n;
    const auto k = exponential_coefficients(squared);
    const auto r = reference_coefficients(std::sqrt(static_cast<long double>(squared)));
    const double got[4] = {k.sine, k.cosine, k.sine_derivative, k.cosine_derivative};
    for (int c = 0; c < 4; ++c) {
      // sin n / n vanishes at pi: there the unit is that of its largest value.
      const double scale = c == 0 ? std::max(0.1L, std::abs(r[c])) : std::abs(r[c]);
      worst[c] = std::max(worst[c], std::abs(static_cast<double>(got[c] - r[c])) / scale / eps);
    }
  }
  for (int c = 0; c < 4; ++c) EXPECT_LT(worst[c], 6) << "coefficient " << c << " [ulp]";
}

TEST(RotationsExponential, CoefficientsStayAccurateOverManyTurns) {
  for (double n :
       {3.2, 4.49, 6.28, 2 * std::numbers::pi, 6.3, 12.5, 12.6, 40.0, 1000.0, 12345.678}) {
    const auto k = exponential_coefficients(n * n);
    const auto r = reference_coefficients(std::sqrt(static_cast<long double>(n * n)));
    const double unit = 1e-15 * n;  // a rounding of n itself moves sin n by n eps
    EXPECT_NEAR(k.sine * n, static_cast<double>(r[0] * n), unit) << n;
    EXPECT_NEAR(k.cosine * n * n, static_cast<double>(r[1] * n * n), 2 * unit) << n;
    EXPECT_NEAR(k.sine_derivative * n * n, static_cast<double>(r[2] * n * n), 2 * unit) << n;
    EXPECT_NEAR(k.cosine_derivative * n * n * n, static_cast<double>(r[3] * n * n * n), 3 * unit)
        << n;
  }
}

TEST(RotationsExponential, FloatCoefficients) {
  for (int i = 0; i <= 3000; ++i) {
    const float n = 0.001F * static_cast<float>(i) * 3.14F;
    const auto k = exponential_coefficients(n * n);
    const auto r = reference_coefficients(std::sqrt(static_cast<long double>(n * n)));
    EXPECT_NEAR(k.sine, static_cast<double>(r[0]), 1e-6) << n;
    EXPECT_NEAR(k.cosine, static_cast<double>(r[1]), 6e-7) << n;
    EXPECT_NEAR(k.sine_derivative, static_cast<double>(r[2]), 6e-7) << n;
    EXPECT_NEAR(k.cosine_derivative, static_cast<double>(r[3]), 2e-7) << n;
  }
}

Eigen::Matrix3d by_quaternion(const Eigen::Vector3d& theta) {
  const Eigen::Matrix<long double, 3, 1> t = theta.cast<long double>();
  const long double n = t.norm();
  if (n == 0) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix<long double, 3, 1> v = t * (std::sin(n / 2) / n);
  return Eigen::Quaternion<long double>(std::cos(n / 2), v.x(), v.y(), v.z())
      .toRotationMatrix()
      .cast<double>();
}

std::vector<Eigen::Vector3d> sample_vectors() {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> result = {Eigen::Vector3d::Zero(),
                                         {0, 0, std::numbers::pi},
                                         {2 * std::numbers::pi, 0, 0},
                                         {0, 4 * std::numbers::pi, 0}};
  for (double length : {1e-300, 1e-20, 1e-9, 1e-5, 1e-3, 0.1, 1.0, 1.99, 2.0, 2.01, 3.0,
                        std::numbers::pi, 3.2, 6.2, 6.29, 12.0, 50.0}) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d direction(normal(random), normal(random), normal(random));
      result.push_back(length * direction.normalized());
    }
  }
  return result;
}

TEST(RotationsExponential, AgreesWithQuaternionsInLongDouble) {
  for (const Eigen::Vector3d& theta : sample_vectors()) {
    const double tolerance = 1e-15 * std::max(1.0, theta.norm());
    EXPECT_LT((exponential(theta) - by_quaternion(theta)).cwiseAbs().maxCoeff(), tolerance)
        << theta.transpose();
  }
}

TEST(RotationsExponential, SmallAnglesKeepTheirDigits) {
  const Eigen::Vector3d theta = 1e-9 * Eigen::Vector3d(1, -2, 0.5);
  const Eigen::Matrix3d w = cross_matrix(theta);
  const Eigen::Matrix3d difference = exponential_minus_identity(theta) - (w + 0.5 * w * w);
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-24);
}

TEST(RotationsExponential, DerivativeAgreesWithDifferences) {
  for (const Eigen::Vector3d& theta : sample_vectors()) {
    const Eigen::Matrix<double, 9, 3> derivative = exponential_derivative(theta);
    for (int k = 0; k < 3; ++k) {
      // Fourth-order central differences.
      const double step = 2e-3;
      const Eigen::Vector3d e = Eigen::Vector3d::Unit(k);
      const Eigen::Matrix3d difference =
          (8 * (exponential(theta + step * e) - exponential(theta - step * e)) -
           (exponential(theta + 2 * step * e) - exponential(theta - 2 * step * e))) /
          (12 * step);
      const Eigen::Map<const Eigen::Matrix3d> got(derivative.col(k).data());
      EXPECT_LT((got - difference).norm(), 5e-11) << theta.transpose() << " axis " << k;
    }
    const Eigen::Vector3d direction(0.3, -0.2, 0.7);
    const Eigen::Matrix<double, 9, 1> sum = derivative * direction;
    const Eigen::Matrix3d along = exponential_derivative(theta, direction);
    EXPECT_EQ(0, (Eigen::Map<const Eigen::Matrix3d>(sum.data()) - along).norm());
  }
}

template <class T>
void expect_batch_agrees(double tolerance) {
  const auto vectors = sample_vectors();
  for (int count : {0, 1, 3, 7, 8, 9, static_cast<int>(vectors.size())}) {
    const int stride = count + 3;
    std::vector<T> theta(3 * stride + 1), rotation(9 * stride + 1, T(-7));
    for (int i = 0; i < count; ++i) {
      for (int c = 0; c < 3; ++c) theta[c * stride + i] = static_cast<T>(vectors[i][c]);
    }
    exponential_batch<T>(count, theta.data(), stride, rotation.data(), stride);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d rounded(theta[i], theta[stride + i], theta[2 * stride + i]);
      const Eigen::Matrix3d expected = exponential(rounded);
      for (int e = 0; e < 9; ++e) {
        EXPECT_NEAR(rotation[e * stride + i], expected.data()[e],
                    tolerance * std::max(1.0, rounded.norm()));
      }
    }
    for (int e = 0; e < 9; ++e)
      EXPECT_EQ(rotation[e * stride + count], T(-7)) << "wrote past the end";
  }
}
TEST(RotationsExponential, BatchAgreesWithSingleDouble) { expect_batch_agrees<double>(1e-15); }
TEST(RotationsExponential, BatchAgreesWithSingleFloat) { expect_batch_agrees<float>(1e-6); }

}  // namespace
}  // namespace limber::rotations
