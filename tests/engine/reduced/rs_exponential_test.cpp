#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

#include "engine/base/random.h"
#include "engine/reduced/rs_coordinates.h"
#include "tests/engine/reduced/random_values.h"

namespace limber::reduced {
namespace {

using testing::random_coordinates;
using LongMatrix = Eigen::Matrix<long double, 3, 3>;

LongMatrix cross(const RsVector& y) {
  LongMatrix w;
  w << 0, -y[2], y[1], y[2], 0, -y[0], -y[1], y[0], 0;
  return w;
}
LongMatrix stretch(const RsVector& y) {
  LongMatrix s;
  s << 1 + static_cast<long double>(y[3]), y[8], y[7], y[8], 1 + static_cast<long double>(y[4]),
      y[6], y[7], y[6], 1 + static_cast<long double>(y[5]);
  return s;
}

// Pade approximation with scaling and squaring, in extended precision: shares nothing with our
// series.
TEST(RsExponential, GradientIsThatOfAMatrixExponential) {
  Random random(1);
  for (double angle = 1e-9; angle < 26; angle *= 1.7) {
    for (int trial = 0; trial < 5; ++trial) {
      const RsVector y = random_coordinates(angle, 0.3, random);
      const LongMatrix turn = cross(y).exp();
      const LongMatrix expected = turn * stretch(y) - LongMatrix::Identity();
      const Eigen::Matrix3d got = displacement_gradient(y);
      EXPECT_LT((got - expected.cast<double>()).norm(), 1e-15 * (4 + 2 * angle)) << angle;
    }
  }
}

// exp([A E; 0 A]) = [exp(A) L; 0 exp(A)], L the derivative of exp at A in direction E.
TEST(RsExponential, DerivativeIsTheFrechetDerivativeOfTheExponential) {
  using Block = Eigen::Matrix<long double, 6, 6>;
  Random random(2);
  for (double angle : {1e-10, 1e-7, 1e-5, 1e-3, 0.03, 0.3, 1.0, 3.0, 3.14159, 6.28, 6.29, 13.0}) {
    const RsVector y = random_coordinates(angle, 0.3, random);
    const Eigen::Matrix<double, 9, 9> derivative = displacement_gradient_derivative(y);
    for (int c = 0; c < 9; ++c) {
      LongMatrix expected;
      if (c < 3) {
        Block block = Block::Zero();
        block.topLeftCorner<3, 3>() = block.bottomRightCorner<3, 3>() = cross(y);
        block.topRightCorner<3, 3>() = cross(RsVector::Unit(c));
        const Block both = block.exp();
        expected = both.topRightCorner<3, 3>() * stretch(y);
      } else {
        const LongMatrix turn = cross(y).exp();
        expected = turn * (stretch(RsVector::Unit(c)) - LongMatrix::Identity());
      }
      const Eigen::Map<const Eigen::Matrix3d> got(derivative.col(c).data());
      EXPECT_LT((got - expected.cast<double>()).norm(), 2e-15 * (4 + 2 * angle))
          << "angle " << angle << " component " << c;
    }
  }
}

}  // namespace
}  // namespace limber::reduced
