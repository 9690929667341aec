#include "engine/reduced/rs_coordinates.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "tests/engine/reduced/random_values.h"

namespace limber::reduced {
namespace {

using testing::random_coordinates;

TEST(RsCoordinates, PartsOfAGradient) {
  Random random(1);
  Eigen::Matrix3d h;
  for (int i = 0; i < 9; ++i) h.data()[i] = random.normal();
  const RsVector y = rs_of_gradient(h);
  const Eigen::Matrix3d antisymmetric = 0.5 * (h - h.transpose()),
                        symmetric = 0.5 * (h + h.transpose());
  EXPECT_LT((rotations::cross_matrix(y.head<3>()) - antisymmetric).norm(), 1e-15);
  EXPECT_EQ(y[3], symmetric(0, 0));
  EXPECT_EQ(y[4], symmetric(1, 1));
  EXPECT_EQ(y[5], symmetric(2, 2));
  EXPECT_EQ(y[6], symmetric(1, 2));
  EXPECT_EQ(y[7], symmetric(0, 2));
  EXPECT_EQ(y[8], symmetric(0, 1));
  EXPECT_LT((linear_gradient(y) - h).norm(), 1e-15);
}

TEST(RsCoordinates, GradientIsRotationTimesStretch) {
  Random random(2);
  for (double angle : {0.0, 1e-9, 1e-3, 0.7, 3.0, 6.3, 12.0}) {
    RsVector y = angle > 0 ? random_coordinates(angle, 0.3, random) : RsVector::Zero();
    Eigen::Matrix3d s;
    s << y[3], y[8], y[7], y[8], y[4], y[6], y[7], y[6], y[5];
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d expected = rotations::exponential(y.head<3>()) * (one + s) - one;
    EXPECT_LT((displacement_gradient(y) - expected).norm(), 1e-14) << angle;
  }
}

TEST(RsCoordinates, TinyCoordinatesKeepTheirDigits) {
  Random random(3);
  const RsVector y = 1e-10 * random_coordinates(1, 1, random);
  EXPECT_LT((displacement_gradient(y) - linear_gradient(y)).norm(), 1e-19);
}

TEST(RsCoordinates, DerivativeAgreesWithDifferences) {
  Random random(4);
  for (double angle : {1e-12, 1e-4, 0.5, 2.0, 3.1, 6.28, 9.0}) {
    const RsVector y = random_coordinates(angle, 0.2, random);
    const Eigen::Matrix<double, 9, 9> derivative = displacement_gradient_derivative(y);
    for (int c = 0; c < 9; ++c) {
      const double step = 2e-3;
      const auto at = [&](double t) -> Eigen::Matrix3d {
        return displacement_gradient(y + t * RsVector::Unit(c));
      };
      const Eigen::Matrix3d difference =
          (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step);
      const Eigen::Map<const Eigen::Matrix3d> got(derivative.col(c).data());
      EXPECT_LT((got - difference).norm(), 1e-10) << "angle " << angle << " component " << c;
    }
  }
}

TEST(RsCoordinates, LinearMapGivesThePartsInEveryTet) {
  bodies::TetMesh mesh;
  mesh.nodes.resize(3, 5);
  mesh.nodes << 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 1, 1;
  mesh.tets.resize(4, 2);
  mesh.tets << 0, 1, 1, 2, 2, 3, 3, 4;
  const auto volume = [&](int e) {
    Eigen::Matrix3d edges;
    for (int a = 0; a < 3; ++a)
      edges.col(a) = mesh.nodes.col(mesh.tets(a + 1, e)) - mesh.nodes.col(mesh.tets(0, e));
    return edges.determinant();
  };
  if (volume(1) < 0) std::swap(mesh.tets(0, 1), mesh.tets(1, 1));
  ASSERT_GT(volume(0), 0);
  const bodies::GradientOperator gradient(mesh);
  Random random(5);
  Eigen::Matrix3d h;
  for (int i = 0; i < 9; ++i) h.data()[i] = random.normal();
  const Eigen::Matrix3Xd field = (h * mesh.nodes).colwise() + Eigen::Vector3d(3, -2, 1);
  const Eigen::MatrixXd u = Eigen::Map<const Eigen::VectorXd>(field.data(), 15);
  const Eigen::MatrixXd y = linear_coordinates(gradient, u);
  ASSERT_EQ(18, y.rows());
  for (int e = 0; e < 2; ++e)
    EXPECT_LT((y.col(0).segment<9>(9 * e) - rs_of_gradient(h)).norm(), 1e-13);
  EXPECT_EQ(y.bottomRows(9), linear_coordinates(gradient, std::vector<int>{1}, u));
}

}  // namespace
}  // namespace limber::reduced
