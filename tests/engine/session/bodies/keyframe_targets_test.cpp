#include "engine/session/bodies/keyframe_targets.h"

#include <gtest/gtest.h>

#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using test::Live;

/// The bar, its x stretched and its y sheared by so much.
std::shared_ptr<const Eigen::VectorXd> pose(const scene::Scene& scene, double size) {
  Eigen::Matrix3Xd displacements(3, scene.mesh.node_count());
  for (int i = 0; i < scene.mesh.node_count(); ++i) {
    const double x = scene.mesh.nodes(0, i);
    displacements.col(i) = Eigen::Vector3d(0.1 * size * x, size * x * x, 0);
  }
  return std::make_shared<const Eigen::VectorXd>(displacements.reshaped());
}

scene::Keyframe keyframe(std::uint64_t id, int frame, std::shared_ptr<const Eigen::VectorXd> pose) {
  scene::Keyframe made;
  made.id = id;
  made.frame = frame;
  made.pose = std::move(pose);
  return made;
}

void expect_as_anew(KeyframeTargets& targets, const scene::Scene& scene, const Live& live,
                    const std::vector<scene::Keyframe>& keyframes) {
  KeyframeTargets fresh(scene, live.session.model());
  const std::vector<KeyframeTarget> got = targets.project(keyframes);
  const std::vector<KeyframeTarget> wanted = fresh.project(keyframes);
  ASSERT_EQ(got.size(), wanted.size());
  for (std::size_t k = 0; k < got.size(); ++k) {
    EXPECT_EQ(got[k].constraint, wanted[k].constraint);
    EXPECT_GT(got[k].constraint.coordinates.norm(), 1e-3);
    ASSERT_TRUE(got[k].rest && wanted[k].rest);
    EXPECT_EQ(got[k].rest->coordinates, wanted[k].rest->coordinates);
    EXPECT_EQ(got[k].rest->shown, wanted[k].rest->shown);
  }
}

/// Poses that are known are not projected again: what they are known by must not deceive.
void expect_edits_as_anew(const scene::Scene& scene) {
  const Live live(scene);
  ASSERT_TRUE(live.recorder->wait_final(0));
  KeyframeTargets targets(scene, live.session.model());
  std::vector<scene::Keyframe> keyframes;
  for (int k = 0; k < 12; ++k)
    keyframes.push_back(keyframe(static_cast<std::uint64_t>(k + 1), 20 - k, pose(scene, 0.1 + k)));
  expect_as_anew(targets, scene, live, keyframes);
  keyframes[3].frame = 23;  // moved, its pose the same
  keyframes[4].weight = 7;
  expect_as_anew(targets, scene, live, keyframes);
  // The pose that goes may leave its address to the one that comes.
  keyframes[5].pose.reset();
  keyframes[5].pose = pose(scene, -2);
  keyframes.push_back(keyframe(13, 22, keyframes[0].pose));  // a pose in two frames
  expect_as_anew(targets, scene, live, keyframes);
  keyframes.erase(keyframes.begin(), keyframes.begin() + 8);
  expect_as_anew(targets, scene, live, keyframes);
}

TEST(KeyframeTargets, EditsOfAHeldBodysKeyframesComeOutAsAnew) {
  expect_edits_as_anew(test::bar(test::kCells, 30));
}

TEST(KeyframeTargets, EditsOfAFreeBodysKeyframesComeOutAsAnew) {
  scene::Scene scene = test::bar(test::kCells, 30);
  scene.fixed_nodes.clear();
  expect_edits_as_anew(scene);
}

TEST(KeyframeTargets, EditsOverABaseMotionComeOutAsAnew) {
  scene::Scene scene = test::bar(test::kCells, 30);
  scene.base_motion.setZero(3 * scene.mesh.node_count(), 30);
  for (int frame = 0; frame < 30; ++frame)
    scene.base_motion.col(frame) = 0.05 * frame * *pose(scene, 0.3);
  expect_edits_as_anew(scene);
}

}  // namespace
}  // namespace limber::session
