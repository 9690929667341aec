#include "engine/scene/keyframe_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/scene/samples/samples.h"
#include "tests/engine/scene/not_finite.h"

namespace limber::scene {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::kInfinity;
using testing::kNan;

Keyframe keyframe(const Scene& scene, int frame, double value = 0.01) {
  Keyframe made;
  made.frame = frame;
  made.pose = std::make_shared<const Eigen::VectorXd>(
      Eigen::VectorXd::Constant(scene.mesh.nodes.size(), value));
  return made;
}

Keyframe with_pose(const Scene& scene, Eigen::Index size, Eigen::Index at, double value) {
  Keyframe made = keyframe(scene, 10);
  Eigen::VectorXd pose = Eigen::VectorXd::Zero(size);
  pose[at] = value;
  made.pose = std::make_shared<const Eigen::VectorXd>(pose);
  return made;
}

std::vector<std::string> fields(const Scene& scene) {
  std::vector<std::string> found;
  for (const Issue& issue : validate(scene)) found.push_back(issue.field);
  return found;
}

TEST(KeyframeRules, EveryFaultOfEveryKeyframeIsNamed) {
  Scene scene = make_sample("beam");
  const Eigen::Index rows = scene.mesh.nodes.size();
  scene.keyframes = {keyframe(scene, 10), keyframe(scene, 20), keyframe(scene, 30)};
  scene.keyframes[1].weight = kInfinity;
  scene.keyframes[2].id = 7;
  EXPECT_THAT(fields(scene), IsEmpty());

  scene.keyframes[0].frame = scene.frame_count;
  scene.keyframes[1].weight = 0;
  scene.keyframes[2] = with_pose(scene, rows - 3, 0, 0);
  EXPECT_THAT(fields(scene),
              ElementsAre("keyframes[0].frame", "keyframes[1].weight", "keyframes[2].pose"));
  scene.keyframes = {with_pose(scene, rows, 3 * 17 + 1, kNan)};
  ASSERT_THAT(fields(scene), ElementsAre("keyframes[0].pose"));
  EXPECT_EQ(validate(scene)[0].message, "has a value that is not finite: node 17");
  scene.keyframes = {with_pose(scene, rows, 5, -1e12)};
  ASSERT_THAT(fields(scene), ElementsAre("keyframes[0].pose"));
  EXPECT_EQ(validate(scene)[0].code, ErrorCode::kOutOfRange);
  scene.keyframes[0].pose.reset();
  EXPECT_THAT(fields(scene), ElementsAre("keyframes[0].pose"));
  for (const double weight : {kNan, -1.0, 1e13, 1e-31}) {
    scene.keyframes = {keyframe(scene, 10)};
    scene.keyframes[0].weight = weight;
    EXPECT_THAT(fields(scene), ElementsAre("keyframes[0].weight")) << weight;
  }
}

TEST(KeyframeRules, IdsAndFramesAreTakenOnce) {
  Scene scene = make_sample("beam");
  scene.keyframes = {keyframe(scene, 10), keyframe(scene, 20), keyframe(scene, 20)};
  scene.keyframes[0].id = scene.keyframes[2].id = 4;
  EXPECT_THAT(fields(scene), ElementsAre("keyframes[2].id", "keyframes[2].frame"));
  EXPECT_EQ(validate(scene)[1].code, ErrorCode::kAlreadyExists);
  scene.keyframes.assign(kMaxKeyframes + 1, keyframe(scene, 10));
  EXPECT_THAT(fields(scene), ElementsAre("keyframes"));
}

TEST(KeyframeRules, FramesThatAnEndHoldsAreWarnedOf) {
  Scene scene = make_sample("beam");
  const int last = scene.frame_count - 1;
  scene.keyframes = {keyframe(scene, 1), keyframe(scene, 2), keyframe(scene, last)};
  EXPECT_THAT(fields(scene), ElementsAre("keyframes[0].frame", "keyframes[2].frame"));
  EXPECT_EQ(validate(scene)[0].severity, Issue::Severity::kWarning);
  scene.last_end = End::kFree;
  EXPECT_THAT(fields(scene), ElementsAre("keyframes[0].frame"));
}

}  // namespace
}  // namespace limber::scene
