// Bodies that lag behind their animation, from the scene to the frames that a client gets.
#include <gtest/gtest.h>

#include "engine/spacetime/force_rows.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using scene::End;
using test::held;
using test::kCells;
using test::kInfinity;
using test::kTip;
using test::Live;

constexpr int kCarriedFrames = 60, kBegin = 10, kEnd = 22;

/// Where the base is along y, over its way.
double share_in(int frame) {
  const double s = std::clamp((frame - kBegin) / double(kEnd - kBegin), 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

/// The bar of the tests, carried along y.
scene::Scene carried_bar(double way, double inertia) {
  scene::Scene scene = test::bar(kCells, kCarriedFrames);
  scene.base_motion.setZero(scene.mesh.nodes.size(), kCarriedFrames);
  for (int frame = 0; frame < kCarriedFrames; ++frame)
    for (int node = 0; node < scene.mesh.node_count(); ++node)
      scene.base_motion(3 * node + 1, frame) = way * share_in(frame);
  scene.first_end = scene.last_end = End::kFree;
  scene.dynamics.period_frames = 15;
  scene.dynamics.damping_ratio = 0.1;
  scene.dynamics.inertia = inertia;
  return scene;
}

/// Of the tip, behind the base along y.
double lag(const Live& live, const BodyResult& result, const scene::Scene& scene, int frame) {
  return scene.base_motion(3 * kTip + 1, frame) + scene.mesh.nodes(1, kTip) -
         test::tip_at(live.session, result, frame).y();
}

TEST(SessionInertia, WithoutItTheBodyFollows) {
  const scene::Scene scene = carried_bar(0.1, 0);
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  for (int frame = 0; frame < kCarriedFrames; ++frame)
    EXPECT_LT(std::abs(lag(live, *result, scene, frame)), 1e-5);
}

/// Small motions: each mode by its recurrence from rest, frame by frame.
TEST(SessionInertia, IsTheMotionOfTheModesUnderTheAccelerationOfTheBase) {
  const double way = 1e-3;
  const scene::Scene scene = carried_bar(way, 1);
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->report.status, spacetime::SolveStatus::kConverged) << result->report.message;
  const auto model = live.session.model();
  const spacetime::ModeDynamics& dynamics = result->material->dynamics;
  const Eigen::Index modes = dynamics.stiffness.size();
  // Masses of nodes are even enough here: what each mode takes of a push is its share of all mass.
  const bodies::TetMesh& mesh = scene.mesh;
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(mesh.node_count());
  for (int tet = 0; tet < mesh.tet_count(); ++tet) {
    Eigen::Matrix3d edges;
    for (int corner = 1; corner < 4; ++corner)
      edges.col(corner - 1) =
          mesh.nodes.col(mesh.tets(corner, tet)) - mesh.nodes.col(mesh.tets(0, tet));
    for (int corner = 0; corner < 4; ++corner)
      mass[mesh.tets(corner, tet)] += std::abs(edges.determinant());
  }
  Eigen::VectorXd tip = Eigen::VectorXd::Zero(kCarriedFrames);
  for (Eigen::Index k = 0; k < modes; ++k) {
    double push = 0, modal = 0;
    for (int node = 0; node < mesh.node_count(); ++node) {
      push += mass[node] * model->modes(3 * node + 1, k);
      modal += mass[node] * model->modes.col(k).segment<3>(3 * node).squaredNorm();
    }
    const spacetime::ForceStencil stencil = spacetime::force_stencil(dynamics, k);
    double before = 0, now = 0;
    for (int frame = 1; frame + 1 < kCarriedFrames; ++frame) {
      const double acceleration =
          way * (share_in(frame + 1) - 2 * share_in(frame) + share_in(frame - 1));
      const double next =
          (-push / modal * acceleration - stencil.centre * now - stencil.before * before) /
          stencil.next;
      before = now;
      now = next;
      tip[frame + 1] += model->modes(3 * kTip + 1, k) * now;
    }
  }
  double largest = 0;
  for (int frame = 0; frame < kCarriedFrames; ++frame) {
    EXPECT_NEAR(-lag(live, *result, scene, frame), tip[frame], 2e-3 * way) << frame;
    largest = std::max(largest, lag(live, *result, scene, frame));
  }
  EXPECT_GT(largest, 0.05 * way) << "it lags behind";
  EXPECT_LT(result->report.force_energy, 1e-9) << "without control forces";
}

TEST(SessionInertia, IsEditedLiveUnderConstraints) {
  scene::Scene scene = carried_bar(0.1, 0);
  scene::Constraint tip = held(40, kTip, {0, 0.1, 0.05});
  tip.weight = kInfinity;
  scene.constraints = {tip};
  Live live(scene);
  const auto followed = live.recorder->wait_final(0);
  scene::DynamicsRequest heavier{30, 15, 0.1, {}, {}, 1.0};
  const auto lagged = live.edit({SetDynamics{heavier}});
  EXPECT_EQ(lagged->report.status, spacetime::SolveStatus::kConverged) << lagged->report.message;
  EXPECT_GT(std::abs(lag(live, *lagged, scene, 14) - lag(live, *followed, scene, 14)), 1e-3);
  EXPECT_LT(
      (test::tip_at(live.session, *lagged, 40) - scene.mesh.nodes.col(kTip) - tip.target).norm(),
      1e-5);
  scene.dynamics.inertia = 1;
  Live cold(scene);
  EXPECT_NEAR(lagged->report.total_energy, cold.recorder->wait_final(0)->report.total_energy,
              1e-6 * lagged->report.total_energy);
  const auto back = live.edit({Undo{}});
  EXPECT_NEAR(back->report.total_energy, followed->report.total_energy,
              1e-6 * followed->report.total_energy);
}

TEST(SessionInertia, FitsAreRefusedInWords) {
  scene::Scene scene = carried_bar(0.1, 1);
  scene.constraints = {held(40, kTip, {0, 0.1, 0.05})};
  Live live(scene);
  (void)live.recorder->wait_final(0);
  const auto result = live.edit({SetMaterialVariables{scene::MaterialVariables::kDynamics}});
  EXPECT_NE(result->report.message.find("no material is fitted"), std::string::npos)
      << result->report.message;
  scene::DynamicsRequest published{30, 15, 0.0, scene::Discretisation::kDifferences, 0.0, 1.0};
  EXPECT_THROW(live.session.edit({SetDynamics{published}}), Error);
  scene::DynamicsRequest far{30, 15, 0.1, {}, {}, 11.0};
  EXPECT_THROW(live.session.edit({SetDynamics{far}}), Error);
}

}  // namespace
}  // namespace limber::session
