#include "engine/base/rotations/polar.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "tests/support/dense.h"

namespace limber::rotations {
namespace {

Eigen::Matrix3d random_matrix(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::Matrix3d result;
  for (int i = 0; i < 9; ++i) result.data()[i] = normal(random);
  return result;
}

// The nearest proper rotation by singular values: an independent method.
Eigen::Matrix3d by_svd(const Eigen::Matrix3d& f) {
  auto [u, values, v] = reference::svd(f);
  if ((u * v.transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * v.transpose();
}

void expect_polar(const Eigen::Matrix3d& f, double tolerance) {
  const Polar polar = polar_decomposition(f);
  const Eigen::Matrix3d r = polar.rotation.toRotationMatrix();
  const double scale = std::max(1e-300, f.norm());
  EXPECT_NEAR(r.determinant(), 1, 1e-14);
  EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_LT((r * polar.stretch - f).norm() / scale, tolerance) << f;
  EXPECT_EQ(0, (polar.stretch - polar.stretch.transpose()).norm());
}

TEST(RotationsPolar, AgreesWithSingularValues) {
  std::mt19937_64 random(3);
  int inverted = 0;
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Matrix3d f = random_matrix(random);
    inverted += f.determinant() < 0 ? 1 : 0;
    expect_polar(f, 1e-13);
    const Eigen::Vector3d sigma = reference::svd(f).values;
    const double gap = sigma[1] + (f.determinant() < 0 ? -sigma[2] : sigma[2]);
    const Eigen::Matrix3d r = polar_decomposition(f).rotation.toRotationMatrix();
    EXPECT_LT((r - by_svd(f)).norm(), 1e-14 * f.norm() / gap) << f;
  }
  EXPECT_GT(inverted, 1000);
}

TEST(RotationsPolar, PureRotationsAndStretchesComeBack) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Matrix3d r = by_svd(random_matrix(random));
    Eigen::Matrix3d s = random_matrix(random);
    s = (Eigen::Matrix3d::Identity() + 0.1 * (s + s.transpose())).eval();
    if (reference::symmetric_eigenvalues(s)[0] < 0.2) continue;
    const Polar polar = polar_decomposition(r * s);
    EXPECT_LT((polar.rotation.toRotationMatrix() - r).norm(), 1e-13);
    EXPECT_LT((polar.stretch - s).norm(), 1e-13);
  }
}

TEST(RotationsPolar, NearlySingularGradients) {
  std::mt19937_64 random(5);
  for (double small : {1e-3, 1e-8, 1e-14, 0.0}) {
    for (int i = 0; i < 100; ++i) {
      const Eigen::Matrix3d u = by_svd(random_matrix(random)), v = by_svd(random_matrix(random));
      expect_polar(u * Eigen::Vector3d(2, 1, small).asDiagonal() * v, 1e-13);  // flat
      expect_polar(u * Eigen::Vector3d(2, 1, -small).asDiagonal() * v,
                   1e-13);  // just turned inside out
      expect_polar(u * Eigen::Vector3d(1, small, small).asDiagonal() * v, 1e-13);
    }
  }
}

TEST(RotationsPolar, ExtremeScalesAndZero) {
  std::mt19937_64 random(6);
  for (double scale : {1e-200, 1e-20, 1e20, 1e150})
    expect_polar(scale * random_matrix(random), 1e-13);
  const Polar zero = polar_decomposition(Eigen::Matrix3d::Zero());
  EXPECT_EQ(1, zero.rotation.w());
  EXPECT_EQ(0, zero.stretch.norm());
}

TEST(RotationsPolar, InvertedCubeStillHasProperRotation) {
  const Polar polar = polar_decomposition(Eigen::Vector3d(1, 1, -0.5).asDiagonal());
  EXPECT_LT((polar.rotation.toRotationMatrix() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_NEAR(polar.stretch(2, 2), -0.5, 1e-15);
}

}  // namespace
}  // namespace limber::rotations
