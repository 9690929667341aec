#include "engine/reduced/full_kinematics.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/reduced/full_shapes.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::random_motion;

/// A body with its modes alone: neither basis nor cubature.
struct Bare {
  bodies::ElasticBody body;
  std::shared_ptr<const ReducedModel> model;
  std::shared_ptr<const FullReconstruction> full;

  explicit Bare(bodies::ElasticBody of) : body(std::move(of)) {
    const ScaledModes modes = testing::modes_of(body);
    auto made = std::make_shared<ReducedModel>();
    made->node_count = body.mesh.node_count();
    made->length = 0.8;
    made->rigid_count = body.is_free() ? 6 : 0;
    made->modes = modes.modes;
    made->eigenvalues = Eigen::VectorXd::Ones(modes.modes.cols());
    model = std::move(made);
    full = std::make_shared<const FullReconstruction>(body);
  }
};

Eigen::Vector3d mean_of(const Site& site, const Eigen::VectorXd& u) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < site.nodes.size(); ++i)
    mean += site.weight(i) * u.segment<3>(3 * Eigen::Index{site.nodes[i]});
  return mean;
}

/// Values against whole reconstructions, Jacobians against fourth-order differences of them.
void expect_full_values(const Bare& bare, const Eigen::MatrixXd& base) {
  FullKinematics kinematics(bare.body, bare.model, bare.full, base);
  FullShapes shapes(bare.body, bare.model, base);
  const std::vector<Site> groups = {
      {{31}, {}}, {{5, 17, 40}, {}}, {{23}, {}}, {{31, 17, 8}, {0.7, -0.2, 0.5}}};
  std::vector<SiteId> sites;
  sites.reserve(groups.size());
  for (const auto& group : groups) sites.push_back(kinematics.add_site(group));
  const Eigen::MatrixXd z = random_motion(bare.model->coordinate_count(), 5, 0.15, 1);
  const std::vector<int> frames = {3, 0, 2, 4, 1};
  const auto shape = [&](int column, const Eigen::VectorXd& at) -> Eigen::VectorXd {
    const int frame = frames[static_cast<std::size_t>(column)];
    return shapes.displacements({&frame, 1}, bare.model->modes * at).col(0);
  };
  // More queries of one column than a pass takes along.
  std::vector<SiteQuery> queries = {{sites[2], 0}, {sites[0], 3}};
  for (int i = 0; i < 10; ++i) queries.push_back({sites[static_cast<std::size_t>(i % 4)], 2});
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd jacobian;
  kinematics.evaluate(frames, z, queries, u, &jacobian);
  ASSERT_EQ(u.cols(), static_cast<Eigen::Index>(queries.size()));
  ASSERT_EQ(jacobian.rows(), 3 * u.cols());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const auto& group = groups[static_cast<std::size_t>(queries[i].site)];
    const int column = queries[i].column;
    const Eigen::VectorXd at = z.col(column);
    const auto index = static_cast<Eigen::Index>(i);
    EXPECT_LT((u.col(index) - mean_of(group, shape(column, at))).norm(), 1e-12) << i;
    for (Eigen::Index k = 0; k < at.size(); ++k) {
      constexpr double kStep = 2e-3;
      const Eigen::VectorXd e = kStep * Eigen::VectorXd::Unit(at.size(), k);
      const auto value = [&](const Eigen::VectorXd& where) {
        return mean_of(group, shape(column, where));
      };
      const Eigen::Vector3d difference =
          (8 * (value(at + e) - value(at - e)) - (value(at + 2 * e) - value(at - 2 * e))) /
          (12 * kStep);
      EXPECT_LT((jacobian.col(k).segment<3>(3 * index) - difference).norm(), 1e-9) << i << " " << k;
    }
  }
  Eigen::Matrix3Xd alone;
  kinematics.evaluate(frames, z, queries, alone, nullptr);
  EXPECT_EQ(u, alone);

  Eigen::MatrixXd closed, differences;
  const Eigen::Matrix3Xd multipliers =
      testing::random_matrix(3, static_cast<Eigen::Index>(queries.size()), 5);
  kinematics.curvature(frames, z, queries, multipliers, closed);
  kinematics.Kinematics::curvature(frames, z, queries, multipliers, differences);
  ASSERT_EQ(closed.cols(), differences.cols());
  EXPECT_GT(differences.norm(), 0.1);
  EXPECT_LT((closed - differences).norm(), 1e-8 * differences.norm());
}

TEST(FullKinematics, IsTheFullReconstructionOfAHeldBody) {
  expect_full_values(Bare(testing::block(8, 3, 3, 0.1, true)), {});
}

TEST(FullKinematics, IsTheFullReconstructionOfAFreeBody) {
  expect_full_values(Bare(testing::block(6, 3, 2, 0.1, false)), {});
}

TEST(FullKinematics, IsTheFullReconstructionOverABaseMotion) {
  for (const bool held : {true, false}) {
    const Bare bare(testing::block(6, 3, 2, 0.1, held));
    const Eigen::MatrixXd z = random_motion(bare.model->coordinate_count(), 6, 0.05, 3);
    expect_full_values(bare, bare.full->from_linear(bare.model->modes * z));
  }
}

TEST(FullKinematics, BodyOfOneTet) {
  bodies::ElasticBody body;
  body.mesh.nodes.resize(3, 4);
  body.mesh.nodes << 0, 1, 0, 0,  //
      0, 0, 1, 0,                 //
      0, 0, 0, 1;
  body.mesh.tets.resize(4, 1);
  body.mesh.tets << 0, 1, 2, 3;
  body.mesh.materials = {{1e6, 0.3, 1000}};
  body.mesh.tet_material = {0};
  body.fixed_nodes = {0, 1, 2};
  auto model = std::make_shared<ReducedModel>();
  model->node_count = 4;
  model->length = 1;
  model->modes = Eigen::MatrixXd::Zero(12, 3);
  model->modes.bottomRows<3>().setIdentity();
  model->eigenvalues = Eigen::VectorXd::Ones(3);
  const auto full = std::make_shared<const FullReconstruction>(body);
  FullKinematics kinematics(body, model, full);
  const SiteId tip = kinematics.add_site({3}), held = kinematics.add_site({0, 1});
  EXPECT_TRUE(kinematics.moves(tip));
  EXPECT_FALSE(kinematics.moves(held));
  const Eigen::Vector3d z(0.2, -0.4, 0.3);
  const std::vector<SiteQuery> queries = {{tip, 0}, {held, 0}};
  const int frame = 0;
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd jacobian;
  kinematics.evaluate({&frame, 1}, z, queries, u, &jacobian);
  const Eigen::VectorXd all = full->from_linear(Eigen::MatrixXd(model->modes * z)).col(0);
  EXPECT_LT((u.col(0) - all.tail<3>()).norm(), 1e-14);
  EXPECT_TRUE(u.col(1).isZero(0));
  EXPECT_TRUE(jacobian.bottomRows<3>().isZero(0));
}

TEST(FullKinematics, ResultsDoNotDependOnTheNumberOfThreads) {
  const Bare bare(testing::block(8, 3, 3, 0.1, true));
  FullKinematics kinematics(bare.body, bare.model, bare.full);
  std::vector<SiteQuery> queries;
  queries.reserve(30);
  for (int i = 0; i < 30; ++i) queries.push_back({kinematics.add_site({40 + i}), i % 7});
  const Eigen::MatrixXd z = random_motion(bare.model->coordinate_count(), 7, 0.2, 2);
  const std::vector<int> frames(7, 0);
  const int before = thread_count();
  Eigen::Matrix3Xd u[2];
  Eigen::MatrixXd jacobian[2], curvature[2];
  for (const int run : {0, 1}) {
    set_thread_count(run == 0 ? 1 : 4);
    kinematics.evaluate(frames, z, queries, u[run], &jacobian[run]);
    kinematics.curvature(frames, z, queries, Eigen::Matrix3Xd::Ones(3, 30), curvature[run]);
  }
  set_thread_count(before);
  EXPECT_EQ(u[0], u[1]);
  EXPECT_EQ(jacobian[0], jacobian[1]);
  EXPECT_EQ(curvature[0], curvature[1]);
}

TEST(FullKinematics, SitesCountAsThoseOfTheReducedModel) {
  const Bare bare(testing::block(4, 2, 2, 0.1, true));
  FullKinematics kinematics(bare.body, bare.model, bare.full);
  EXPECT_EQ(kinematics.add_site({30}), 0);
  EXPECT_EQ(kinematics.add_site({31, 12}), 1);
  EXPECT_EQ(kinematics.add_site({30}), 0);
  EXPECT_EQ(kinematics.add_site({12, 31}), 1);
  EXPECT_THROW(kinematics.add_site(std::vector<int>()), Error);
  EXPECT_THROW(kinematics.add_site({bare.body.mesh.node_count()}), Error);
  EXPECT_THROW(static_cast<void>(kinematics.moves(2)), Error);
  Eigen::Matrix3Xd u;
  const std::vector<SiteQuery> far = {{0, 1}};
  const int frame = 0;
  EXPECT_THROW(kinematics.evaluate({&frame, 1}, Eigen::MatrixXd::Zero(8, 1), far, u, nullptr),
               Error);
}

TEST(FullKinematics, FramesBeyondTheBaseMotionAreRefused) {
  const Bare bare(testing::block(4, 2, 2, 0.1, true));
  FullKinematics kinematics(bare.body, bare.model, bare.full,
                            Eigen::MatrixXd::Zero(3 * Eigen::Index{bare.model->node_count}, 4));
  const std::vector<SiteQuery> queries = {{kinematics.add_site({30}), 0}};
  Eigen::Matrix3Xd u;
  for (const int frame : {-1, 4}) {
    EXPECT_THROW(kinematics.evaluate({&frame, 1}, Eigen::MatrixXd::Zero(8, 1), queries, u, nullptr),
                 Error);
  }
}

}  // namespace
}  // namespace limber::reduced
