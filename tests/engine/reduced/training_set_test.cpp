#include "engine/reduced/training_set.h"

#include <gtest/gtest.h>

#include "engine/bodies/modal_analysis.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/support/dense.h"

namespace limber::reduced {
namespace {

TEST(TrainingSet, AutomaticCountsFallWithTheSizeOfTheBody) {
  EXPECT_EQ(2400, automatic_training_poses(1));
  EXPECT_EQ(2400, automatic_training_poses(60000));
  EXPECT_EQ(1200, automatic_training_poses(120000));
  EXPECT_EQ(600, automatic_training_poses(240000));
  EXPECT_EQ(600, automatic_training_poses(20000000));
}

// 800 poses are kept in full for the basis; the rest is reconstructed when the basis is known, to
// the same coordinates as if it had been kept.
TEST(TrainingSet, PosesLeftForLaterAreTheSamePoses) {
  const bodies::ElasticBody body = testing::block(3, 1, 1, 0.1, true);
  ModelOptions options;
  options.mode_count = 5;
  options.training_poses = 900;
  const FullReconstruction full(body);
  const ScaledModes modes =
      scale_modes(body, bodies::modal_analysis(body, {.mode_count = options.mode_count}));
  const TrainingSet set = make_training_set(body, modes, full, options, {});
  EXPECT_EQ(800, set.train.u.cols());
  ASSERT_EQ(100, set.more.cols());
  const Eigen::MatrixXd basis = reference::ThinQr(modes.modes).q();
  const PoseData poses = project_training(set, modes, full, basis, {});
  ASSERT_EQ(900, poses.count());
  const Eigen::MatrixXd u = full.from_linear(modes.modes * poses.z);
  EXPECT_LT((poses.q - basis.transpose() * u).norm(), 1e-12 * poses.q.norm());
  EXPECT_LT((poses.norm - u.colwise().norm().transpose()).norm(), 1e-12 * poses.norm.norm());

  options.training_poses = 0;
  const TrainingSet automatic = make_training_set(body, modes, full, options, {});
  EXPECT_EQ(2400, automatic.train.z.cols() + automatic.more.cols());
}

}  // namespace
}  // namespace limber::reduced
