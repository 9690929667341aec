#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/rs_coordinates.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/engine/reduced/test_poses.h"

namespace limber::reduced {
namespace {

ModelOptions small_options() {
  ModelOptions options;
  options.mode_count = 10;
  options.basis_size = 40;
  options.cubature_size = 10;
  options.training_poses = 150;
  options.test_poses = 40;
  return options;
}

// With z = 0 the model gives back the base motion as B sees it.
TEST(BaseMotion, RestOfTheEditIsTheBaseMotion) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 3, 2, 0.1, held);
    const auto model = std::make_shared<const ReducedModel>(build_model(body, small_options()));
    const FullReconstruction full(body);
    constexpr int kFrames = 12;
    Random random(4);
    Eigen::VectorXd to = Eigen::VectorXd::Zero(model->coordinate_count());
    for (Eigen::Index k = 0; k < to.size(); ++k) to[k] = 0.15 * random.normal();
    Eigen::MatrixXd z(to.size(), kFrames);
    for (int f = 0; f < kFrames; ++f) z.col(f) = to * (f + 1.0) / kFrames;
    const Eigen::MatrixXd u = full.from_linear(model->modes * z);
    const auto base = std::make_shared<const BaseMotion>(base_motion(body, *model, u));
    const ReducedKinematics kinematics(model, base);
    Eigen::MatrixXf q;
    kinematics.coordinates(0, Eigen::MatrixXd::Zero(to.size(), kFrames), q);
    ASSERT_EQ(kFrames, q.cols());
    for (int f = 0; f < kFrames; ++f) {
      const Eigen::VectorXd got = model->basis * q.col(f).cast<double>();
      const Eigen::VectorXd seen = model->basis * (model->basis.transpose() * u.col(f));
      EXPECT_LT((got - seen).norm(), 1e-5 * seen.norm()) << held << " " << f;
      EXPECT_LT((got - u.col(f)).norm(), 3 * model->report.error_mean * u.col(f).norm())
          << held << " " << f;
    }
  }
}

TEST(BaseMotion, BadDisplacementsAreRefused) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, true);
  const ReducedModel model = build_model(body, small_options());
  const Eigen::Index rows = 3 * body.mesh.node_count();
  EXPECT_THROW((void)base_motion(body, model, Eigen::MatrixXd::Zero(rows - 3, 4)), Error);
  EXPECT_THROW(
      (void)base_motion(testing::block(3, 2, 2, 0.1, true), model, Eigen::MatrixXd::Zero(rows, 4)),
      Error);
  Eigen::MatrixXd u = Eigen::MatrixXd::Zero(rows, 4);
  u(5, 2) = std::nan("");
  try {
    (void)base_motion(body, model, u);
    FAIL() << "NaN was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(ErrorCode::kInvalidArgument, error.code());
    EXPECT_EQ("base_motion[2]", error.field());
  }
}

}  // namespace
}  // namespace limber::reduced
