#include "engine/reduced/base_load.h"

#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <vector>

#include "engine/base/rotations/exponential_map.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/full_kinematics.h"
#include "engine/reduced/full_shapes.h"
#include "engine/reduced/reduced_model.h"
#include "engine/reduced/scaled_modes.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

constexpr int kLoadedFrames = 12;

ScaledModes loaded_modes(const bodies::ElasticBody& body) {
  bodies::ModalOptions options;
  options.mode_count = 6;
  return scale_modes(body, bodies::modal_analysis(body, options, {}));
}

/// x = 0.01 i^2 along an axis: an acceleration of 0.02 a frame in inner frames.
Eigen::MatrixXd pushed(const bodies::ElasticBody& body, int axis) {
  Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(3 * body.mesh.node_count(), kLoadedFrames);
  for (int frame = 0; frame < kLoadedFrames; ++frame)
    for (int node = 0; node < body.mesh.node_count(); ++node)
      motion(3 * node + axis, frame) = 0.01 * frame * frame;
  return motion;
}

TEST(BaseLoad, OfAPushIsTheMassTimesTheAcceleration) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, true);
  const ScaledModes scaled = loaded_modes(body);
  const BaseLoad load = base_load(body, scaled.modes, 0, pushed(body, 1));
  // Of each node a quarter of the tets around it.
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(body.mesh.node_count());
  for (int tet = 0; tet < body.mesh.tet_count(); ++tet) {
    Eigen::Matrix3d edges;
    for (int corner = 1; corner < 4; ++corner)
      edges.col(corner - 1) = body.mesh.nodes.col(body.mesh.tets(corner, tet)) -
                              body.mesh.nodes.col(body.mesh.tets(0, tet));
    const double quarter = std::abs(edges.determinant()) / 24 * body.mesh.material_of(tet).density;
    for (int corner = 0; corner < 4; ++corner) mass[body.mesh.tets(corner, tet)] += quarter;
  }
  for (int k = 0; k < scaled.count(); ++k) {
    double force = 0, modal = 0;
    for (int node = 0; node < body.mesh.node_count(); ++node) {
      force -= mass[node] * scaled.modes(3 * node + 1, k) * 0.02;
      modal += mass[node] * scaled.modes.col(k).segment<3>(3 * node).squaredNorm();
    }
    EXPECT_NEAR(load.masses[k], modal, 1e-12 * modal);
    for (int frame = 1; frame + 1 < kLoadedFrames; ++frame)
      EXPECT_NEAR(load.forces(k, frame), force, 1e-9 * load.forces.cwiseAbs().maxCoeff());
  }
  EXPECT_GT(load.forces.col(3).cwiseAbs().maxCoeff(), 0);
  // Modes that are mixed half and half have the mean of both forces.
  Eigen::MatrixXd mixing = Eigen::MatrixXd::Zero(scaled.count(), 1);
  mixing(0, 0) = mixing(1, 0) = 0.5;
  EXPECT_NEAR(
      load.of_modes(mixing)(0, 3),
      0.5 * (load.forces(0, 3) + load.forces(1, 3)) / (0.25 * (load.masses[0] + load.masses[1])),
      1e-12 * load.of_modes(mixing).cwiseAbs().maxCoeff());
}

/// Modes turn with the body: so does what acts on them.
TEST(BaseLoad, DoesNotDependOnHowTheBodyIsTurned) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, true);
  const ScaledModes scaled = loaded_modes(body);
  const BaseLoad straight = base_load(body, scaled.modes, 0, pushed(body, 1));
  const Eigen::Matrix3d turn =
      rotations::exponential(Eigen::Vector3d(0.4, -1.1, std::numbers::pi / 2));
  Eigen::MatrixXd turned = pushed(body, 1);
  for (int frame = 0; frame < kLoadedFrames; ++frame) {
    const Eigen::Matrix3Xd there =
        body.mesh.nodes + turned.col(frame).reshaped(3, body.mesh.node_count());
    turned.col(frame) = (turn * there - body.mesh.nodes).reshaped();
  }
  const BaseLoad load = base_load(body, scaled.modes, 0, turned);
  EXPECT_LT((load.forces - straight.forces).cwiseAbs().maxCoeff(),
            1e-9 * straight.forces.cwiseAbs().maxCoeff());
}

TEST(BaseLoad, LeavesWhatNothingHolds) {
  const bodies::ElasticBody body = testing::block(4, 2, 2, 0.1, false);
  const ScaledModes scaled = loaded_modes(body);
  ASSERT_EQ(scaled.rigid_count, 6);
  const BaseLoad load = base_load(body, scaled.modes, 6, pushed(body, 0));
  EXPECT_EQ(load.forces.topRows(6).cwiseAbs().maxCoeff(), 0);
  EXPECT_TRUE(load.forces.allFinite());
}

/// The full shapes of a body at rest in its base are the base, wherever its pins go.
TEST(MovingPins, CarryTheFullShapesAlong) {
  const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, true);
  ModelOptions options;
  options.mode_count = 6;
  options.training_poses = 100;
  options.test_poses = 20;
  Eigen::MatrixXd base = pushed(body, 1);
  for (int frame = 0; frame < kLoadedFrames; ++frame) {
    const Eigen::Matrix3d turn = rotations::exponential(Eigen::Vector3d(0, 0, 0.1 * frame));
    const Eigen::Matrix3Xd there =
        body.mesh.nodes + base.col(frame).reshaped(3, body.mesh.node_count());
    base.col(frame) = (turn * there - body.mesh.nodes).reshaped();
  }
  const auto model = std::make_shared<const ReducedModel>(build_model(body, options, {}, base));
  FullShapes shapes(body, model, base);
  const auto reconstruction = std::make_shared<const FullReconstruction>(body);
  FullKinematics kinematics(body, model, reconstruction, base);
  const SiteId site = kinematics.add_site(Site{{body.mesh.node_count() - 1}, {}});
  const std::vector<int> frames = {0, 5, 11};
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(3 * body.mesh.node_count(), 3);
  const Eigen::MatrixXd u = shapes.displacements(frames, rest);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT((u.col(i) - base.col(frames[static_cast<std::size_t>(i)])).cwiseAbs().maxCoeff(),
              1e-5);
    const SiteQuery query{site, 0};
    Eigen::Matrix3Xd at;
    kinematics.evaluate({&frames[static_cast<std::size_t>(i)], 1},
                        Eigen::MatrixXd::Zero(model->coordinate_count(), 1), {&query, 1}, at,
                        nullptr);
    EXPECT_LT((at.col(0) - base.col(frames[static_cast<std::size_t>(i)]).tail<3>()).norm(), 1e-5);
  }
  // The reduced model spans it, too.
  const auto moving = std::make_shared<const BaseMotion>(base_motion(body, *model, base));
  const ReducedKinematics reduced(model, moving);
  Eigen::MatrixXf q;
  reduced.coordinates(0, Eigen::MatrixXd::Zero(model->coordinate_count(), kLoadedFrames), q);
  EXPECT_LT((model->basis * q.cast<double>() - base).cwiseAbs().maxCoeff(),
            0.02 * base.cwiseAbs().maxCoeff());
}

}  // namespace
}  // namespace limber::reduced
