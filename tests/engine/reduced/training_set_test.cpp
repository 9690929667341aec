#include "engine/reduced/training_set.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "engine/bodies/modal_analysis.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/support/dense.h"

namespace limber::reduced {
namespace {

TEST(TrainingSet, AutomaticCountsFallWithTheSizeOfTheBody) {
  EXPECT_EQ(2400, automatic_training_poses(1));
  EXPECT_EQ(2400, automatic_training_poses(40000));
  EXPECT_EQ(1200, automatic_training_poses(80000));
  EXPECT_EQ(600, automatic_training_poses(160000));
  EXPECT_EQ(600, automatic_training_poses(20000000));
}

// 800 poses are kept in full for the basis; of the rest only what the basis sees is found, to the
// same coordinates as if they had been kept.
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
  const PoseData poses = project_training(set, modes, full, basis, 1e-5, {});
  ASSERT_EQ(900, poses.count());
  const Eigen::MatrixXd u = full.from_linear(modes.modes * poses.z);
  EXPECT_LT((poses.q - basis.transpose() * u).norm(), 1e-12 * poses.q.norm());
  const Eigen::VectorXd norm = u.colwise().norm();
  EXPECT_LT((poses.norm - norm).head(800).norm(), 1e-12 * norm.norm());
  EXPECT_LT((poses.norm - poses.q.colwise().norm().transpose()).tail(100).norm(),
            1e-12 * norm.norm());

  options.training_poses = 0;
  const TrainingSet automatic = make_training_set(body, modes, full, options, {});
  EXPECT_EQ(2400, automatic.train.z.cols() + automatic.more.cols());
}

// B^T u without solves for the poses, of a held and of a free body (whose mean displacement u takes
// from the linear field).
TEST(TrainingSet, AdjointSeesWhatReconstructionsShow) {
  for (const bool is_held : {true, false}) {
    const bodies::ElasticBody body = testing::block(3, 2, 2, 0.1, is_held);
    const FullReconstruction full(body);
    Random random(5);
    Eigen::MatrixXd basis(3 * body.mesh.node_count(), 7), v(basis.rows(), 11);
    for (double& entry : basis.reshaped()) entry = random.uniform(-1, 1);
    for (double& entry : v.reshaped()) entry = random.uniform(-0.1, 0.1);
    for (const int node : body.fixed_nodes) v.middleRows(3 * node, 3).setZero();
    const Eigen::MatrixXd expected = basis.transpose() * full.from_linear(v);
    using Precision = FullReconstruction::Precision;
    const FullReconstruction::Adjoint adjoint = full.adjoint(basis);
    const Eigen::MatrixXd q = full.project_linear(adjoint, v, Precision::kDouble);
    EXPECT_LT((q - expected).norm(), 1e-11 * expected.norm()) << is_held;
    const Eigen::MatrixXd single = full.project_linear(adjoint, v, Precision::kSingle);
    EXPECT_LT((single - expected).norm(), 1e-5 * expected.norm()) << is_held;
  }
}

TEST(TrainingSet, LargeMeshesMakeBasesOfFewerPoses) {
  const bodies::ElasticBody body = testing::block(18, 18, 18, 0.1, true);
  ASSERT_GT(body.mesh.tet_count(), 16000);
  ModelOptions options;
  options.mode_count = 2;
  options.training_poses = 450;
  options.test_poses = 10;
  const ScaledModes modes =
      scale_modes(body, bodies::modal_analysis(body, {.mode_count = options.mode_count}));
  const TrainingSet set = make_training_set(body, modes, FullReconstruction(body), options, {});
  EXPECT_EQ(400, set.train.u.cols());
  EXPECT_EQ(50, set.more.cols());
}

}  // namespace
}  // namespace limber::reduced
