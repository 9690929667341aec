#include "engine/reduced/layered_kinematics.h"

#include <gtest/gtest.h>

#include "engine/reduced/reduced_model.h"
#include "tests/engine/reduced/random_values.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using Level = LayeredKinematics::Level;
using testing::random_motion;

/// A model that is off by percents, two sites, and poses of two frames.
struct Layered {
  bodies::ElasticBody body = testing::block(5, 2, 2, 0.1, true);
  std::shared_ptr<const ReducedModel> model;
  std::optional<LayeredKinematics> kinematics;
  std::vector<int> frames = {4, 7};
  Eigen::MatrixXd z;
  std::vector<SiteQuery> queries = {{0, 0}, {1, 1}, {1, 0}};

  Layered() {
    ModelOptions options;
    options.mode_count = 8;
    options.basis_size = 10;
    options.cubature_size = 4;
    model = std::make_shared<const ReducedModel>(build_model(body, options));
    kinematics.emplace(std::make_shared<ReducedKinematics>(model));
    kinematics->add_site({50});
    kinematics->add_site({33, 47});
    kinematics->set_full(std::make_unique<FullKinematics>(
        body, model, std::make_shared<const FullReconstruction>(body)));
    z = random_motion(model->coordinate_count(), 2, 0.2, 3);
  }

  struct Values {
    Eigen::Matrix3Xd u;
    Eigen::MatrixXd jacobian;
  };
  [[nodiscard]] Values at(const Eigen::MatrixXd& where) const {
    Values values;
    kinematics->evaluate(frames, where, queries, values.u, &values.jacobian);
    return values;
  }
  [[nodiscard]] Values at(Level level) {
    kinematics->use(level);
    return at(z);
  }
};

TEST(LayeredKinematics, LevelsAreTheTwoMaps) {
  Layered layered;
  const auto reduced = layered.at(Level::kReduced), full = layered.at(Level::kFull);
  EXPECT_GT((reduced.u - full.u).norm(), 1e-3 * full.u.norm());
  FullKinematics alone(layered.body, layered.model,
                       std::make_shared<const FullReconstruction>(layered.body));
  alone.add_site({50});
  alone.add_site({33, 47});
  Eigen::Matrix3Xd u;
  alone.evaluate(layered.frames, layered.z, layered.queries, u, nullptr);
  EXPECT_EQ(u, full.u);
}

TEST(LayeredKinematics, AtAnAnchorTheReducedModelIsTheFullMapInValueAndJacobian) {
  Layered layered;
  const auto full = layered.at(Level::kFull);
  layered.kinematics->anchor(layered.frames, layered.z, layered.queries);
  const auto reduced = layered.at(Level::kReduced);
  EXPECT_LT((reduced.u - full.u).norm(), 1e-14);
  EXPECT_LT((reduced.jacobian - full.jacobian).norm(), 1e-13);
}

TEST(LayeredKinematics, FullMapIsGivenUpWhenNobodyWantsItAnyMore) {
  Layered layered;
  const auto full = layered.at(Level::kFull);
  const Cancellation unwanted;
  layered.kinematics->heed(unwanted);
  EXPECT_EQ(layered.at(Level::kFull).u, full.u);
  unwanted.request();
  const Eigen::Matrix3Xd multipliers = Eigen::Matrix3Xd::Ones(3, 3);
  Eigen::MatrixXd second;
  EXPECT_THROW(static_cast<void>(layered.at(Level::kFull)), Error);
  EXPECT_THROW(layered.kinematics->curvature(layered.frames, layered.z, layered.queries,
                                             multipliers, second),
               Error);
  EXPECT_THROW(layered.kinematics->anchor(layered.frames, layered.z, layered.queries), Error);
  layered.kinematics->add_site({12});
  EXPECT_THROW(layered.kinematics->use(Level::kFull), Error) << "another site of the full map";
  layered.kinematics->use(Level::kReduced);
  EXPECT_NO_THROW(static_cast<void>(layered.at(Level::kReduced))) << "the reduced model is quick";
  layered.kinematics->heed({});
  EXPECT_EQ(layered.at(Level::kFull).u, full.u);
}

TEST(LayeredKinematics, ABitAwayFromAnAnchorTheErrorIsSmaller) {
  Layered layered;
  layered.kinematics->anchor(layered.frames, layered.z, layered.queries);
  Layered plain;
  layered.z *= 1.1;
  plain.z *= 1.1;
  const auto full = layered.at(Level::kFull);
  const double corrected = (layered.at(Level::kReduced).u - full.u).norm();
  EXPECT_LT(corrected, 0.2 * (plain.at(Level::kReduced).u - full.u).norm());
}

/// Nor do frames that it is not of.
TEST(LayeredKinematics, FarFromAnAnchorItCountsLittle) {
  Layered layered, plain;
  layered.kinematics->anchor(layered.frames, layered.z, layered.queries);
  const double near = (layered.at(layered.z).u - plain.at(layered.z).u).norm();
  EXPECT_LT((layered.at(-20 * layered.z).u - plain.at(-20 * layered.z).u).norm(), 0.1 * near);
  layered.frames = {5, 6};
  EXPECT_EQ(layered.at(layered.z).u, plain.at(layered.z).u);
}

/// Of anchors and of shifts of frames, away from where they were found.
TEST(LayeredKinematics, DerivativesAreThoseOfTheValues) {
  for (const bool anchored : {true, false}) {
    Layered layered;
    auto shift = std::make_shared<FrameShift>();
    shift->basis = {layered.model, &layered.model->basis};
    shift->shift = random_motion(layered.model->basis_size(), 10, 0.02, 4).cast<float>();
    shift->poses = random_motion(layered.model->coordinate_count(), 10, 0.2, 5);
    layered.kinematics->set_shift(std::move(shift));
    if (anchored) layered.kinematics->anchor(layered.frames, layered.z, layered.queries);
    const Eigen::MatrixXd z = 1.2 * layered.z;
    const Eigen::Matrix3Xd multipliers = random_motion(3, 3, 1, 6);
    Eigen::MatrixXd curvature;
    layered.kinematics->curvature(layered.frames, z, layered.queries, multipliers, curvature);
    const auto values = layered.at(z);
    const Eigen::Index size = z.rows();
    for (int column = 0; column < 2; ++column) {
      const auto block = curvature.middleCols(column * size, size);
      EXPECT_LT((block - block.transpose()).norm(), 1e-12);
      for (Eigen::Index k = 0; k < size; ++k) {
        constexpr double kStep = 1e-4;
        Eigen::MatrixXd right = z, left = z;
        right(k, column) += kStep;
        left(k, column) -= kStep;
        const auto after = layered.at(right), before = layered.at(left);
        Eigen::VectorXd pull = Eigen::VectorXd::Zero(size);
        for (std::size_t i = 0; i < layered.queries.size(); ++i) {
          if (layered.queries[i].column != column) continue;
          const auto row = static_cast<Eigen::Index>(i);
          const Eigen::Vector3d difference = (after.u.col(row) - before.u.col(row)) / (2 * kStep);
          EXPECT_LT((values.jacobian.col(k).segment<3>(3 * row) - difference).norm(), 1e-7);
          pull += (after.jacobian - before.jacobian).middleRows<3>(3 * row).transpose() *
                  multipliers.col(row) / (2 * kStep);
        }
        EXPECT_LT((block.col(k) - pull).norm(), 1e-6 * (1 + pull.norm())) << anchored << k;
      }
    }
  }
}

TEST(LayeredKinematics, WithoutAShiftThereAreNoAnchors) {
  Layered layered, plain;
  layered.kinematics->anchor(layered.frames, layered.z, layered.queries);
  layered.kinematics->set_shift(nullptr);
  EXPECT_EQ(layered.at(layered.z).u, plain.at(layered.z).u);
}

}  // namespace
}  // namespace limber::reduced
