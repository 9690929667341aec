#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::random_motion;

ModelOptions padded_options() {
  ModelOptions options;
  options.mode_count = 12;
  options.basis_size = 30;
  options.cubature_size = 9;  // not a multiple of a register: padding is exercised
  options.training_poses = 150;
  options.test_poses = 40;
  return options;
}

std::shared_ptr<const ReducedModel> beam_model() {
  static const auto model = std::make_shared<const ReducedModel>(
      build_model(testing::block(8, 3, 3, 0.1, true), padded_options()));
  return model;
}
std::shared_ptr<const ReducedModel> free_model() {
  static const auto model = [] {
    ModelOptions options = padded_options();
    options.basis_size = 60;
    options.cubature_size = 15;
    return std::make_shared<const ReducedModel>(
        build_model(testing::block(6, 3, 2, 0.1, false), options));
  }();
  return model;
}

BaseMotion some_base(const ReducedModel& model, int frames) {
  Random random(77);
  BaseMotion base{Eigen::MatrixXd(9 * model.cubature_size(), frames),
                  Eigen::MatrixXd(model.basis_size(), frames),
                  {}};
  for (Eigen::Index i = 0; i < base.rs.size(); ++i) base.rs.data()[i] = 0.3 * random.normal();
  for (Eigen::Index i = 0; i < base.direct.size(); ++i)
    base.direct.data()[i] = 0.1 * random.normal();
  return base;
}

// u = B (H g(y_base + Y z) + D z + q_base), written plainly.
Eigen::VectorXd plain_displacements(const ReducedModel& model, const BaseMotion* base, int frame,
                                    const Eigen::VectorXd& z) {
  Eigen::VectorXd y = model.rs_modes * z;
  Eigen::VectorXd q = model.direct * z;
  if (base != nullptr) {
    y += base->rs.col(frame);
    q += base->direct.col(frame);
  }
  Eigen::VectorXd g(y.size());
  for (Eigen::Index t = 0; t < y.size(); t += 9) {
    Eigen::Map<Eigen::Matrix3d>(g.data() + t) = displacement_gradient(y.segment<9>(t));
  }
  return model.basis * (q + model.map * g);
}

void expect_plain_values(const std::shared_ptr<const ReducedModel>& model,
                         const std::shared_ptr<const BaseMotion>& base) {
  ReducedKinematics kinematics(model, base);
  const Eigen::MatrixXd z = random_motion(model->coordinate_count(), 7, 0.3, 1);
  const std::vector<int> frames = {3, 0, 5, 6, 1, 2, 4};
  const std::vector<int> group = {5, 17, 40};
  const SiteId tip = kinematics.add_site({31}), patch = kinematics.add_site(group);
  EXPECT_EQ(tip, kinematics.add_site({31}));
  const SiteId point = kinematics.add_site(Site{{40, 5, 17}, {0.7, 0.5, -0.2}});
  EXPECT_NE(tip, patch);
  EXPECT_NE(point, patch);
  const std::vector<SiteQuery> queries = {{tip, 4},   {patch, 4}, {tip, 0},  {patch, 6},
                                          {point, 4}, {tip, 4},   {point, 1}};
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd jacobian;
  kinematics.evaluate(frames, z, queries, u, &jacobian);
  ASSERT_EQ(7, u.cols());
  ASSERT_EQ(21, jacobian.rows());
  ASSERT_EQ(model->coordinate_count(), jacobian.cols());
  for (int i = 0; i < 7; ++i) {
    const auto value = [&](const Eigen::VectorXd& at) -> Eigen::Vector3d {
      const Eigen::VectorXd all =
          plain_displacements(*model, base.get(), frames[queries[i].column], at);
      if (queries[i].site == tip) return all.segment<3>(93);
      if (queries[i].site == point)
        return 0.5 * all.segment<3>(15) - 0.2 * all.segment<3>(51) + 0.7 * all.segment<3>(120);
      return (all.segment<3>(15) + all.segment<3>(51) + all.segment<3>(120)) / 3;
    };
    const Eigen::VectorXd at = z.col(queries[i].column);
    EXPECT_LT((u.col(i) - value(at)).norm(), 1e-13) << i;
    for (int k = 0; k < model->coordinate_count(); ++k) {
      const double step = 2e-3;
      const Eigen::VectorXd e = step * Eigen::VectorXd::Unit(at.size(), k);
      const Eigen::Vector3d difference =
          (8 * (value(at + e) - value(at - e)) - (value(at + 2 * e) - value(at - 2 * e))) /
          (12 * step);
      EXPECT_LT((jacobian.col(k).segment<3>(3 * i) - difference).norm(), 1e-8) << i << " " << k;
    }
  }
  Eigen::Matrix3Xd again;
  kinematics.evaluate(frames, z, queries, again, nullptr);
  EXPECT_EQ(u, again);
}

TEST(ReducedKinematics, ValuesAndDerivativesOfAHeldBody) {
  expect_plain_values(beam_model(), nullptr);
}
TEST(ReducedKinematics, ValuesAndDerivativesOfAFreeBody) {
  expect_plain_values(free_model(), nullptr);
}
TEST(ReducedKinematics, ValuesAndDerivativesOverABaseMotion) {
  expect_plain_values(beam_model(),
                      std::make_shared<const BaseMotion>(some_base(*beam_model(), 7)));
}

TEST(ReducedKinematics, SitesOfFixedNodesDoNotMove) {
  ReducedKinematics kinematics(beam_model());
  const bodies::ElasticBody body = testing::block(8, 3, 3, 0.1, true);
  const int fixed = body.fixed_nodes.front();
  int free = 0;
  while (std::count(body.fixed_nodes.begin(), body.fixed_nodes.end(), free) > 0) ++free;
  const SiteId stuck = kinematics.add_site({fixed});
  EXPECT_FALSE(kinematics.moves(stuck));
  EXPECT_TRUE(kinematics.moves(kinematics.add_site({free})));
  EXPECT_TRUE(kinematics.moves(kinematics.add_site({fixed, free})));
  EXPECT_THROW(static_cast<void>(kinematics.moves(99)), Error);
  const int frame = 0;
  const SiteQuery query{stuck, 0};
  const Eigen::MatrixXd z = Eigen::MatrixXd::Constant(kinematics.coordinate_count(), 1, 0.1);
  Eigen::Matrix3Xd u;
  Eigen::MatrixXd jacobian;
  kinematics.evaluate({&frame, 1}, z, {&query, 1}, u, &jacobian);
  EXPECT_TRUE(u.isZero(0));
  EXPECT_TRUE(jacobian.isZero(0));
}

// Odd counts around the size of a block, sizes from tiny to large, with and without base.
TEST(ReducedKinematics, StreamedCoordinatesAgreeWithDoublePrecision) {
  const auto model = beam_model();
  const auto base = std::make_shared<const BaseMotion>(some_base(*model, 400));
  for (const bool with_base : {false, true}) {
    const ReducedKinematics kinematics(model, with_base ? base : nullptr);
    for (const int count : {0, 1, 7, 8, 127, 128, 129, 391}) {
      for (const double size : {1e-4, 1e-2, 0.5}) {
        const Eigen::MatrixXd z = random_motion(model->coordinate_count(), count, size, 9);
        Eigen::MatrixXf q;
        kinematics.coordinates(with_base ? 9 : 0, z, q);
        ASSERT_EQ(model->basis_size(), q.rows());
        ASSERT_EQ(count, q.cols());
        for (int i = 0; i < count; ++i) {
          const Eigen::VectorXd expected =
              model->basis.transpose() *
              plain_displacements(*model, with_base ? base.get() : nullptr, 9 + i, z.col(i));
          ASSERT_LT((q.col(i).cast<double>() - expected).norm(), 2e-6 * expected.norm())
              << count << " " << size;
        }
      }
    }
  }
}

TEST(ReducedKinematics, TranslationOfAFreeBodyIsExact) {
  const auto model = free_model();
  ReducedKinematics kinematics(model);
  const SiteId site = kinematics.add_site({7});
  Eigen::VectorXd z = Eigen::VectorXd::Zero(model->coordinate_count());
  z.head<3>() = Eigen::Vector3d(10, -3, 0.5);  // ten body lengths away
  Eigen::Matrix3Xd u;
  const std::vector<int> frames = {0};
  const std::vector<SiteQuery> queries = {{site, 0}};
  kinematics.evaluate(frames, z, queries, u, nullptr);
  EXPECT_LT((u.col(0) - model->length * z.head<3>()).norm(), 1e-12);
}

// Far beyond the turns of the training poses: three turns about a skew axis.
TEST(ReducedKinematics, RigidRotationOfAFreeBodyIsExact) {
  const auto model = free_model();
  const FullReconstruction full(testing::block(6, 3, 2, 0.1, false));
  for (const double angle : {0.5, 3.0, 6.3, 20.0}) {
    Eigen::VectorXd z = Eigen::VectorXd::Zero(model->coordinate_count());
    z.segment<3>(3) = angle * Eigen::Vector3d(1, 2, -2) / 3;
    const Eigen::MatrixXd linear = model->modes * z;
    const Eigen::VectorXd expected = full.from_linear(linear).col(0);
    EXPECT_LT((plain_displacements(*model, nullptr, 0, z) - expected).norm(),
              1e-10 * expected.norm())
        << angle;
  }
}

TEST(ReducedKinematics, WrongSitesAndFramesAreRefused) {
  const auto model = beam_model();
  ReducedKinematics kinematics(model, std::make_shared<const BaseMotion>(some_base(*model, 3)));
  EXPECT_THROW((void)kinematics.add_site(std::vector<int>()), Error);
  EXPECT_THROW((void)kinematics.add_site({0, model->node_count}), Error);
  EXPECT_THROW((void)kinematics.add_site({-1}), Error);
  const SiteId site = kinematics.add_site({0});
  Eigen::Matrix3Xd u;
  Eigen::MatrixXf q;
  const Eigen::MatrixXd z = random_motion(model->coordinate_count(), 4, 0.1, 2);
  const std::vector<int> frames = {0, 1, 2, 3};
  const std::vector<SiteQuery> inside = {{site, 2}}, outside = {{site, 3}};
  EXPECT_NO_THROW(kinematics.evaluate(frames, z, inside, u, nullptr));
  EXPECT_THROW(kinematics.evaluate(frames, z, outside, u, nullptr), Error);
  const Eigen::Matrix3Xd multipliers = Eigen::Matrix3Xd::Ones(3, 1);
  Eigen::MatrixXd second;
  const auto expect_refused = [&](const SiteQuery& query) {
    const std::vector<SiteQuery> queries = {query};
    const auto code_of = [](const auto& call) {
      try {
        call();
      } catch (const Error& error) {
        return error.code();
      }
      return ErrorCode::kInternal;
    };
    EXPECT_EQ(ErrorCode::kOutOfRange,
              code_of([&] { kinematics.evaluate(frames, z, queries, u, nullptr); }))
        << query.site << " " << query.column;
    EXPECT_EQ(ErrorCode::kOutOfRange,
              code_of([&] { kinematics.curvature(frames, z, queries, multipliers, second); }))
        << query.site << " " << query.column;
  };
  EXPECT_NO_THROW(kinematics.curvature(frames, z, inside, multipliers, second));
  for (const SiteQuery& query :
       {SiteQuery{-1, 0}, {site + 1, 0}, {1000000, 1}, {site, 3}, {site, 4}, {site, -1}}) {
    expect_refused(query);
  }
  EXPECT_THROW(kinematics.coordinates(0, z, q), Error);
  EXPECT_THROW(kinematics.coordinates(-1, z.leftCols(2), q), Error);
  BaseMotion wrong = some_base(*model, 3);
  wrong.rs.conservativeResize(wrong.rs.rows() - 9, Eigen::NoChange);
  EXPECT_THROW(ReducedKinematics(model, std::make_shared<const BaseMotion>(wrong)), Error);
}

}  // namespace
}  // namespace limber::reduced
