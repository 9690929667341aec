#include "engine/reduced/site.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/layered_kinematics.h"
#include "engine/reduced/site_list.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::random_matrix;
using testing::random_motion;

TEST(Sites, AreTheSameInAnyOrder) {
  SiteList list(10);
  EXPECT_EQ(list.add({3, 1}).id, 0);
  EXPECT_EQ(list.add(Site{{3, 1}, {0.25, 0.75}}).id, 1);
  EXPECT_EQ(list.add(Site{{1, 3}, {0.75, 0.25}}).id, 1);
  EXPECT_EQ(list.add(Site{{1, 3}, {0.25, 0.75}}).id, 2);
  EXPECT_EQ(list.add({1, 3}).id, 0);
  EXPECT_EQ(list.site(1).nodes, (std::vector<int>{1, 3}));
  EXPECT_EQ(list.site(1).weights, (std::vector<double>{0.75, 0.25}));
}

TEST(Sites, BadWeightsAreRefused) {
  SiteList list(10);
  const auto field_of = [&](const Site& site) -> std::string {
    try {
      list.add(site);
    } catch (const Error& error) {
      return error.field();
    }
    return "accepted";
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(field_of({{}, {}}), "nodes");
  EXPECT_EQ(field_of({{10, 1}, {0.5, 0.5}}), "nodes");
  EXPECT_EQ(field_of({{2, 1}, {1}}), "weights");
  EXPECT_EQ(field_of({{2, 1}, {0.5, 0.4}}), "weights");
  EXPECT_EQ(field_of({{2, 1}, {kNan, 1}}), "weights");
  EXPECT_EQ(field_of({{2, 1}, {kInfinity, -kInfinity}}), "weights");
  EXPECT_EQ(field_of({{2, 1}, {1.5, -0.5}}), "accepted");
}

TEST(Sites, MeansOfGroupsAreSumsOverTheirNumber) {
  const Eigen::MatrixXd matrix = random_matrix(12, 5, 3);
  const Eigen::Matrix<double, 3, Eigen::Dynamic> sum =
      matrix.middleRows<3>(3) + matrix.middleRows<3>(9);
  EXPECT_EQ(mean_rows(matrix, {{1, 3}, {}}), sum / 2.0);
  const Eigen::Matrix<double, 3, Eigen::Dynamic> weighted =
      1.5 * matrix.middleRows<3>(3) - 0.5 * matrix.middleRows<3>(9);
  EXPECT_LT((mean_rows(matrix, {{1, 3}, {1.5, -0.5}}) - weighted).norm(), 1e-15);
}

struct Values {
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd jacobian, curvature;
};

Values values_of(const Kinematics& kinematics, SiteId site) {
  const Eigen::MatrixXd z = random_motion(kinematics.coordinate_count(), 3, 0.2, 1);
  const std::vector<int> frames = {0, 1, 2};
  const std::vector<SiteQuery> queries = {{site, 2}, {site, 0}};
  Values values;
  kinematics.evaluate(frames, z, queries, values.u, &values.jacobian);
  kinematics.curvature(frames, z, queries, random_matrix(3, 2, 4), values.curvature);
  return values;
}

/// Equal weights, written out, are the group; weights on single nodes add up.
void expect_linear_in_weights(const Kinematics& kinematics,
                              const std::function<SiteId(const Site&)>& add) {
  const std::vector<int> group = {47, 61, 40};
  const Values mean = values_of(kinematics, add({group, {}}));
  const Values equal = values_of(kinematics, add({group, {1.0 / 3, 1.0 / 3, 1.0 / 3}}));
  EXPECT_LT((mean.u - equal.u).norm(), 1e-14 * mean.u.norm());
  EXPECT_LT((mean.jacobian - equal.jacobian).norm(), 1e-14 * mean.jacobian.norm());
  EXPECT_LT((mean.curvature - equal.curvature).norm(), 1e-9 * mean.curvature.norm());
  const std::vector<double> weights = {0.7, -0.2, 0.5};
  const Values weighted = values_of(kinematics, add({group, weights}));
  Values sum{Eigen::Matrix3Xd::Zero(3, mean.u.cols()),
             Eigen::MatrixXd::Zero(mean.jacobian.rows(), mean.jacobian.cols()),
             Eigen::MatrixXd::Zero(mean.curvature.rows(), mean.curvature.cols())};
  for (std::size_t i = 0; i < group.size(); ++i) {
    const Values one = values_of(kinematics, add({{group[i]}, {}}));
    sum.u += weights[i] * one.u;
    sum.jacobian += weights[i] * one.jacobian;
    sum.curvature += weights[i] * one.curvature;
  }
  EXPECT_GT((weighted.u - mean.u).norm(), 1e-3 * mean.u.norm());
  EXPECT_LT((weighted.u - sum.u).norm(), 1e-13 * sum.u.norm());
  EXPECT_LT((weighted.jacobian - sum.jacobian).norm(), 1e-13 * sum.jacobian.norm());
  EXPECT_LT((weighted.curvature - sum.curvature).norm(), 1e-9 * sum.curvature.norm());
}

TEST(Sites, AreLinearInTheirWeightsAtEveryLevel) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, held);
    ModelOptions options;
    options.mode_count = 10;
    options.basis_size = 30;
    options.cubature_size = 9;
    options.training_poses = 150;
    options.test_poses = 40;
    const auto model = std::make_shared<const ReducedModel>(build_model(body, options));
    const auto full = std::make_shared<const FullReconstruction>(body);
    LayeredKinematics layered(std::make_shared<ReducedKinematics>(model));
    const auto add = [&](const Site& site) { return layered.add_site(site); };
    expect_linear_in_weights(layered, add);
    auto shift = std::make_shared<FrameShift>();
    shift->basis = std::make_shared<const Eigen::MatrixXd>(
        random_matrix(model->basis.rows(), model->basis.cols() + 2, 6));
    shift->shift = random_matrix(shift->basis->cols(), 3, 7).cast<float>();
    shift->poses = random_motion(model->coordinate_count(), 3, 0.2, 8);
    layered.set_shift(shift);
    expect_linear_in_weights(layered, add);
    layered.set_shift(nullptr);
    layered.set_full(std::make_unique<FullKinematics>(body, model, full));
    layered.use(LayeredKinematics::Level::kFull);
    expect_linear_in_weights(layered, add);
    // Anchors correct the reduced model to the full one in value and slope.
    layered.use(LayeredKinematics::Level::kReduced);
    const SiteId site = layered.add_site(Site{{47, 61, 40}, {0.7, -0.2, 0.5}});
    const Eigen::MatrixXd z = random_motion(model->coordinate_count(), 3, 0.2, 1);
    const std::vector<int> frames = {0, 1, 2};
    layered.anchor(frames, z, std::vector<SiteQuery>{{site, 2}, {site, 0}});
    const Values anchored = values_of(layered, site);
    layered.use(LayeredKinematics::Level::kFull);
    const Values exact = values_of(layered, site);
    EXPECT_LT((anchored.u - exact.u).norm(), 1e-12 * exact.u.norm());
    EXPECT_LT((anchored.jacobian - exact.jacobian).norm(), 1e-11 * exact.jacobian.norm());
  }
}

TEST(Sites, OfFixedNodesDoNotMove) {
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  ModelOptions options;
  options.mode_count = 10;
  options.basis_size = 20;
  options.cubature_size = 9;
  options.training_poses = 150;
  options.test_poses = 40;
  const auto model = std::make_shared<const ReducedModel>(build_model(body, options));
  FullKinematics exact(body, model, std::make_shared<const FullReconstruction>(body));
  ReducedKinematics reduced(model);
  const std::vector<int>& fixed = body.fixed_nodes;
  int free = 0;
  while (std::count(fixed.begin(), fixed.end(), free) > 0) ++free;
  const Site held{{fixed[0], fixed[1]}, {0.3, 0.7}}, moving{{fixed[0], free}, {0.3, 0.7}};
  EXPECT_FALSE(reduced.moves(reduced.add_site(held)));
  EXPECT_FALSE(exact.moves(exact.add_site(held)));
  EXPECT_TRUE(reduced.moves(reduced.add_site(moving)));
  EXPECT_TRUE(exact.moves(exact.add_site(moving)));
}

}  // namespace
}  // namespace limber::reduced
