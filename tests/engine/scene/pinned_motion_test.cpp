#include "engine/scene/pinned_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "engine/scene/samples/samples.h"

namespace limber::scene {
namespace {

bodies::TetMesh pinned_beam() { return make_sample("beam").mesh; }

/// Nodes at the end of least x.
std::vector<int> lowest(const bodies::TetMesh& mesh) {
  std::vector<int> pins;
  const double low = mesh.nodes.row(0).minCoeff();
  for (int node = 0; node < mesh.node_count(); ++node)
    if (mesh.nodes(0, node) < low + 1e-9) pins.push_back(node);
  return pins;
}

Eigen::MatrixXd moved_pins(const bodies::TetMesh& mesh, const std::vector<int>& pins,
                           const Eigen::Affine3d& by) {
  const Eigen::Matrix3Xd there = by * mesh.nodes(Eigen::all, pins);
  return there.reshaped();
}

TEST(PinnedMotion, RigidPinsCarryTheBodyAlong) {
  const bodies::TetMesh mesh = pinned_beam();
  const auto pins = lowest(mesh);
  ASSERT_GT(pins.size(), 3u);
  for (const double angle : {0.0, 0.7, 2.9}) {
    const Eigen::Affine3d by = Eigen::Translation3d(1, -2, 3) *
                               Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized());
    const Eigen::MatrixXd motion = motion_of_pins(mesh, pins, moved_pins(mesh, pins, by));
    const Eigen::Matrix3Xd expected = by * mesh.nodes - mesh.nodes;
    EXPECT_LT((motion.col(0) - expected.reshaped()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(PinnedMotion, PinsAreWhereTheyAreToBeAndOthersBetweenThem) {
  const bodies::TetMesh mesh = pinned_beam();
  auto pins = lowest(mesh);
  const auto of_one_end = pins.size();
  const double high = mesh.nodes.row(0).maxCoeff();
  for (int node = 0; node < mesh.node_count(); ++node)
    if (mesh.nodes(0, node) > high - 1e-9) pins.push_back(node);
  // One end is lifted: the other nodes are lifted by something between.
  Eigen::Matrix3Xd there = mesh.nodes(Eigen::all, pins);
  for (std::size_t i = of_one_end; i < pins.size(); ++i)
    there(1, static_cast<Eigen::Index>(i)) += 0.001 * high;
  const Eigen::MatrixXd motion = motion_of_pins(mesh, pins, there.reshaped());
  for (std::size_t i = 0; i < pins.size(); ++i) {
    EXPECT_LT((motion.col(0).segment<3>(3 * pins[i]) + mesh.nodes.col(pins[i]) -
               there.col(static_cast<Eigen::Index>(i)))
                  .norm(),
              1e-12 * high);
  }
  for (int node = 0; node < mesh.node_count(); ++node) {
    const double lifted = motion(3 * node + 1, 0) / (0.001 * high);
    EXPECT_GT(lifted, -0.1);
    EXPECT_LT(lifted, 1.1);
  }
}

TEST(PinnedMotion, PinsOnALineTurnNothing) {
  const bodies::TetMesh mesh = pinned_beam();
  for (const std::vector<int>& pins : {std::vector<int>{0}, std::vector<int>{0, 1}}) {
    Eigen::Matrix3Xd there = mesh.nodes(Eigen::all, pins);
    there.colwise() += Eigen::Vector3d(0.1, 0.2, -0.3);
    const Eigen::MatrixXd motion = motion_of_pins(mesh, pins, there.reshaped());
    const Eigen::VectorXd expected =
        Eigen::Vector3d(0.1, 0.2, -0.3).replicate(mesh.node_count(), 1);
    EXPECT_LT((motion.col(0) - expected).cwiseAbs().maxCoeff(), 1e-9);
  }
}

}  // namespace
}  // namespace limber::scene
