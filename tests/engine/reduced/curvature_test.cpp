#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "engine/reduced/reduced_model.h"

namespace limber::reduced {
namespace {

/// A model with random numbers everywhere: derivatives know nothing of where they come from.
std::shared_ptr<const ReducedModel> random_model(int tets, int coordinates, int basis) {
  Random random(7);
  auto model = std::make_shared<ReducedModel>();
  auto fill = [&](Eigen::MatrixXd& matrix, Eigen::Index rows, Eigen::Index columns, double scale) {
    matrix.resize(rows, columns);
    for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = scale * random.normal();
  };
  model->node_count = 4;
  model->length = 1;
  model->eigenvalues = Eigen::VectorXd::Ones(coordinates);
  for (int t = 0; t < tets; ++t) model->tets.push_back(t);
  fill(model->basis, 12, basis, 0.5);
  fill(model->rs_modes, 9 * tets, coordinates, 0.6);
  fill(model->map, basis, 9 * tets, 0.3);
  fill(model->direct, basis, coordinates, 0.3);
  return model;
}

TEST(Curvature, ClosedFormAgreesWithDifferencesOfTheJacobian) {
  const auto model = random_model(7, 6, 5);
  ReducedKinematics kinematics(model);
  const std::vector<SiteQuery> queries = {{kinematics.add_site({0}), 0},
                                          {kinematics.add_site({1, 3}), 1},
                                          {kinematics.add_site({2}), 0}};
  Random random(11);
  Eigen::MatrixXd z(6, 2);
  for (Eigen::Index i = 0; i < z.size(); ++i) z.data()[i] = random.normal();
  Eigen::Matrix3Xd multipliers(3, 3);
  for (Eigen::Index i = 0; i < 9; ++i) multipliers.data()[i] = random.normal();
  const std::vector<int> frames = {0, 1};
  Eigen::MatrixXd closed, differences;
  kinematics.curvature(frames, z, queries, multipliers, closed);
  kinematics.Kinematics::curvature(frames, z, queries, multipliers, differences);
  ASSERT_EQ(closed.rows(), 6);
  ASSERT_EQ(closed.cols(), 12);
  EXPECT_LT((closed - differences).norm(), 1e-8 * differences.norm());
  EXPECT_LT((closed.leftCols(6) - closed.leftCols(6).transpose()).norm(), 1e-9 * closed.norm());
  EXPECT_GT(closed.leftCols(6).norm(), 0.1);
}

TEST(Curvature, IsZeroWithoutMultipliersAndInColumnsWithoutQueries) {
  const auto model = random_model(5, 4, 3);
  ReducedKinematics kinematics(model);
  const std::vector<SiteQuery> queries = {{kinematics.add_site({0}), 1}};
  const Eigen::MatrixXd z = Eigen::MatrixXd::Constant(4, 2, 0.3);
  Eigen::MatrixXd out;
  kinematics.curvature(std::vector<int>{0, 1}, z, queries, Eigen::Matrix3Xd::Ones(3, 1), out);
  EXPECT_EQ(out.leftCols(4).norm(), 0);
  EXPECT_GT(out.rightCols(4).norm(), 0);
  kinematics.curvature(std::vector<int>{0, 1}, z, queries, Eigen::Matrix3Xd::Zero(3, 1), out);
  EXPECT_EQ(out.norm(), 0);
}

}  // namespace
}  // namespace limber::reduced
