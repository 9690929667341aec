#include "engine/base/numerics/growing_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "engine/base/random.h"

namespace limber {
namespace {

TEST(GrowingCholesky, FollowsRandomAppendsAndRemovals) {
  Random random(3);
  constexpr int kSize = 30;
  Eigen::MatrixXd a(kSize + 5, kSize);
  for (double& entry : a.reshaped()) entry = random.normal();
  const Eigen::MatrixXd full = a.transpose() * a;
  GrowingCholesky cholesky(kSize);
  std::vector<int> kept, left;
  for (int j = 0; j < kSize; ++j) left.push_back(j);
  for (int step = 0; step < 400; ++step) {
    if (!left.empty() && (kept.empty() || random.uniform() < 0.55)) {
      const auto pick = static_cast<std::ptrdiff_t>(random.index(left.size()));
      const int column = left[pick];
      const Eigen::VectorXd cross = full.col(column)(kept);
      ASSERT_TRUE(cholesky.append(cross, full(column, column), 1e-12));
      kept.push_back(column);
      left.erase(left.begin() + pick);
    } else {
      const auto pick = static_cast<std::ptrdiff_t>(random.index(kept.size()));
      cholesky.remove(pick);
      left.push_back(kept[pick]);
      kept.erase(kept.begin() + pick);
    }
    ASSERT_EQ(cholesky.size(), static_cast<Eigen::Index>(kept.size()));
    if (kept.empty()) continue;
    const Eigen::MatrixXd block = full(kept, kept);
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(cholesky.size(), 1, 2);
    const Eigen::VectorXd x = cholesky.solve(b);
    ASSERT_LT((block * x - b).norm(), 1e-9 * b.norm()) << "step " << step;
  }
}

TEST(GrowingCholesky, RefusesADependentColumnAndStaysAsItWas) {
  GrowingCholesky cholesky(3);
  ASSERT_TRUE(cholesky.append(Eigen::VectorXd(0), 4, 1e-12));
  EXPECT_FALSE(cholesky.append(Eigen::VectorXd::Constant(1, 2.0), 1, 1e-12));
  EXPECT_EQ(cholesky.size(), 1);
  EXPECT_DOUBLE_EQ(cholesky.solve(Eigen::VectorXd::Constant(1, 8.0))[0], 2);
}

}  // namespace
}  // namespace limber
