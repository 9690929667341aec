#include "engine/base/rotations/rotated_vector.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <numbers>
#include <random>

#include "engine/base/rotations/exponential_map.h"

namespace limber::rotations {
namespace {

using Real = long double;
using RealVector = Eigen::Matrix<Real, 3, 1>;
using RealMatrix = Eigen::Matrix<Real, 3, 3>;

RealMatrix cross_of(const RealVector& w) {
  RealMatrix result;
  result << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return result;
}

/// exp(omega^x) v with all first and second derivatives from the power series of the matrix
/// exponential, term by term, in long double.
struct Reference {
  RealVector value;
  RealVector first[3];
  RealVector second[3][3];
};
Reference reference(const Eigen::Vector3d& omega, const Eigen::Vector3d& v) {
  const RealMatrix w = cross_of(omega.cast<Real>());
  RealMatrix e[3];
  for (int i = 0; i < 3; ++i) e[i] = cross_of(RealVector::Unit(i));
  RealVector p = v.cast<Real>();
  RealVector dp[3], ddp[3][3];
  for (int i = 0; i < 3; ++i) {
    dp[i].setZero();
    for (int j = 0; j < 3; ++j) ddp[i][j].setZero();
  }
  Reference sum{p, {dp[0], dp[1], dp[2]}, {}};
  for (auto& row : sum.second)
    for (auto& entry : row) entry.setZero();
  for (int k = 1; k < 60; ++k) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        ddp[i][j] = ((w * ddp[i][j] + e[i] * dp[j] + e[j] * dp[i]) / Real(k)).eval();
    for (int i = 0; i < 3; ++i) dp[i] = ((w * dp[i] + e[i] * p) / Real(k)).eval();
    p = (w * p / Real(k)).eval();
    sum.value += p;
    for (int i = 0; i < 3; ++i) {
      sum.first[i] += dp[i];
      for (int j = 0; j < 3; ++j) sum.second[i][j] += ddp[i][j];
    }
  }
  return sum;
}

class RotatedVector : public ::testing::TestWithParam<double> {};

TEST_P(RotatedVector, AndBothDerivativesAreGoodToAFewUlps) {
  const double angle = GetParam();
  const double eps = std::numeric_limits<double>::epsilon();
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Vector3d axis(normal(generator), normal(generator), normal(generator));
    const Eigen::Vector3d omega = angle * axis.normalized();
    const Eigen::Vector3d v =
        Eigen::Vector3d(normal(generator), normal(generator), normal(generator)).normalized();
    const Reference expected = reference(omega, v);
    const Eigen::Matrix3d first = rotated_vector_derivative(omega, v);
    const auto second = rotated_vector_second_derivative(omega, v);
    const Eigen::Vector3d value = exponential(omega) * v;
    EXPECT_LT((value.cast<Real>() - expected.value).norm(), 6 * eps);
    Real first_error = 0, second_error = 0, second_norm = 0;
    for (int i = 0; i < 3; ++i) {
      first_error += (first.col(i).cast<Real>() - expected.first[i]).squaredNorm();
      for (int j = 0; j < 3; ++j) {
        const Eigen::Vector3d entry(second[0](i, j), second[1](i, j), second[2](i, j));
        second_error += (entry.cast<Real>() - expected.second[i][j]).squaredNorm();
        second_norm += expected.second[i][j].squaredNorm();
      }
    }
    EXPECT_LT(std::sqrt(first_error), 8 * eps);
    EXPECT_LT(std::sqrt(second_error / second_norm), 8 * eps);
  }
}
INSTANTIATE_TEST_SUITE_P(Angles, RotatedVector,
                         ::testing::Values(0.0, 1e-300, 1e-12, 1e-9, 1e-6, 3e-6, 1e-5, 1e-3, 1e-2,
                                           0.1, 0.7, 1.99, 2.01, 3.0, std::numbers::pi - 1e-3,
                                           std::numbers::pi - 1e-9, std::numbers::pi));

TEST(RotatedVectorPack, AgreesWithTheScalar) {
  using V = Pack<double>;
  const Vec3<V> omega{V([](auto i) { return 0.3 * double(i); }), V(-0.2), V(1.1)};
  const Vec3<V> v{V(1), V(-2), V(0.5)}, weight{V(0.2), V(0.1), V(-0.9)};
  const Rotation<V> packed(omega);
  const Sym3<V> second = packed.second_derivative(v, weight);
  const Mat3<V> first = packed.derivative(v);
  for (int lane = 0; lane < static_cast<int>(V::size()); ++lane) {
    const Rotation<double> one({omega.x[lane], -0.2, 1.1});
    EXPECT_NEAR(second.zy[lane], one.second_derivative({1, -2, 0.5}, {0.2, 0.1, -0.9}).zy, 1e-15);
    EXPECT_NEAR(first.column[1].z[lane], one.derivative({1, -2, 0.5}).column[1].z, 1e-15);
  }
}

TEST(RotatedVectorDual, GivesThirdDerivatives) {
  using D = Dual<double>;
  // Of the Hessian along a direction, against central differences; at zero and across all series.
  for (const double scale : {0.0, 1e-6, 0.3, 1.0, 2.0}) {
    const double omega[3] = {scale, -0.5 * scale, 1.1 * scale}, along[3] = {0.4, -0.7, 0.2};
    const Vec3<double> v{1, -2, 0.5}, weight{0.2, 0.1, -0.9};
    const auto second = [&](double h) {
      return Rotation<double>(
                 {omega[0] + h * along[0], omega[1] + h * along[1], omega[2] + h * along[2]})
          .second_derivative(v, weight);
    };
    const double h = 1e-5;
    const Sym3<double> above = second(h), below = second(-h);
    const Sym3<D> third =
        Rotation<D>({{omega[0], along[0]}, {omega[1], along[1]}, {omega[2], along[2]}})
            .second_derivative({v.x, v.y, v.z}, {weight.x, weight.y, weight.z});
    EXPECT_NEAR(third.xx.value, second(0).xx, 1e-15);
    EXPECT_NEAR(third.xx.derivative, (above.xx - below.xx) / (2 * h), 1e-9) << scale;
    EXPECT_NEAR(third.yx.derivative, (above.yx - below.yx) / (2 * h), 1e-9) << scale;
    EXPECT_NEAR(third.zz.derivative, (above.zz - below.zz) / (2 * h), 1e-9) << scale;
    EXPECT_NEAR(third.zy.derivative, (above.zy - below.zy) / (2 * h), 1e-9) << scale;
    EXPECT_GT(std::abs(third.zy.derivative), 1e-3);
  }
}

}  // namespace
}  // namespace limber::rotations
