#include "engine/base/numerics/banded_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "engine/base/random.h"

namespace limber {
namespace {

struct Band {
  Eigen::MatrixXd dense, band;
};

Band random_band(int n, int width, double shift) {
  Random random(3);
  Band result{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Constant(width + 1, n, 7.0)};
  for (int j = 0; j < n; ++j) {
    for (int d = 0; d <= width && j + d < n; ++d) {
      const double value = random.normal() + (d == 0 ? shift : 0);
      result.dense(j + d, j) = result.dense(j, j + d) = result.band(d, j) = value;
    }
  }
  return result;
}

TEST(BandedCholesky, SolvesAsADenseFactorDoes) {
  for (const auto& [n, width] : {std::pair{1, 0}, {3, 5}, {40, 0}, {40, 7}}) {
    const Band matrix = random_band(n, width, 12);
    BandedCholesky cholesky;
    ASSERT_TRUE(cholesky.factor(matrix.band));
    BandedCholesky::Columns x(n, 3);
    Random random(4);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = random.normal();
    const Eigen::MatrixXd expected = matrix.dense.partialPivLu().solve(Eigen::MatrixXd(x));
    cholesky.solve(x);
    EXPECT_LT((x - expected).norm(), 1e-12 * expected.norm()) << n << " " << width;
  }
}

TEST(BandedCholesky, SaysWhereThereIsNoFactor) {
  BandedCholesky cholesky;
  EXPECT_FALSE(cholesky.factor(random_band(20, 3, -1).band));
  EXPECT_FALSE(cholesky.factor(Eigen::MatrixXd::Zero(2, 4)));
}

}  // namespace
}  // namespace limber
