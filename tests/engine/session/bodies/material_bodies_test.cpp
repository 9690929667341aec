// Fitted materials on samples and on bodies of the public data as they come, with default models:
// quiet, not much farther from frame to frame than with forces alone, never above their start. All
// bodies and tasks: limber-bench material_bodies.
#include "tests/support/material_bodies.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/scene/samples/samples.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using limber::testing::BodyTask;
using limber::testing::FittedMotion;
using test::kMaxHighFrequencyShare;
using ::testing::HasSubstr;
using ::testing::Not;

void expect_quiet_motion(const FittedMotion& motion) {
  ASSERT_TRUE(motion.high_frequency_share) << "nothing was determined";
  EXPECT_LE(*motion.high_frequency_share, kMaxHighFrequencyShare);
}

void expect_true_motion(const FittedMotion& motion) {
  expect_quiet_motion(motion);
  EXPECT_LE(motion.largest_step, 1.5 * motion.largest_step_forces);
  EXPECT_THAT(motion.message, Not(HasSubstr("times as far as the motion with forces alone")));
  EXPECT_LT(motion.energy, motion.energy_forces);
  EXPECT_GT(motion.published, 0);
  EXPECT_EQ(motion.published_above_start, 0);
}

void expect_true_motion(const scene::Scene& body, BodyTask task) {
  const auto cache = test::shared_cache();
  expect_true_motion(limber::testing::fit_motion(with_task(body, task, cache), cache));
}

void expect_true_motion(const std::string& name, BodyTask task) {
  for (const limber::testing::BodyFile& file : limber::testing::public_bodies()) {
    if (file.name != name) continue;
    const char* const root = std::getenv("LIMBER_SHARED");
    const std::filesystem::path shared = root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared";
    const auto body = read_body(file, shared / "data" / "bodies");
    if (!body) GTEST_SKIP() << file.mesh << " of the public data is not there";
    return expect_true_motion(*body, task);
  }
  FAIL() << "no body " << name;
}

TEST(MaterialBodies, Liver) { expect_true_motion("liver", BodyTask::kConstraints); }
TEST(MaterialBodies, LiverWithKeyframes) { expect_true_motion("liver", BodyTask::kKeyframes); }
TEST(MaterialBodies, LiverWithBothEndsFree) {
  expect_true_motion("liver", BodyTask::kBothEndsFree);
}
TEST(MaterialBodies, Mushroom) { expect_true_motion("mushroom", BodyTask::kConstraints); }
TEST(MaterialBodies, PublicDino) { expect_true_motion("public dino", BodyTask::kConstraints); }
TEST(MaterialBodies, FishWithItsLastEndFree) { expect_true_motion("fish", BodyTask::kLastEndFree); }

// The targets of samples are those of FittedMaterials; here they have those of the other bodies.
TEST(MaterialBodies, SampleBeam) {
  expect_true_motion(scene::make_sample("beam"), BodyTask::kConstraints);
}
TEST(MaterialBodies, SampleFlower) {
  expect_true_motion(scene::make_sample("flower"), BodyTask::kConstraints);
}
TEST(MaterialBodies, SampleBird) {
  expect_true_motion(scene::make_sample("bird"), BodyTask::kConstraints);
}
TEST(MaterialBodies, SampleDino) {
  expect_true_motion(scene::make_sample("dino"), BodyTask::kConstraints);
}

/// Forces do not see how far what floats swings between its targets: without a limit, nodes move by
/// up to 10 times what they do with forces alone, and last digits decide which of many motions that
/// cost nothing is found. Much longer steps are reported with the factor.
void expect_no_wild_motion(BodyTask task) {
  const auto cache = test::shared_cache();
  const FittedMotion motion =
      limber::testing::fit_motion(with_task(scene::make_sample("flower"), task, cache), cache);
  expect_quiet_motion(motion);
  EXPECT_LE(motion.energy, motion.energy_forces);
  EXPECT_EQ(motion.published_above_start, 0);
  EXPECT_LE(motion.largest_step_ratio(), 1.5);
  const auto says_so = HasSubstr(fmt::format("{:.3g} times as far as the motion with forces alone",
                                             motion.largest_step_ratio()));
  if (motion.largest_step_ratio() > 1.5) {
    EXPECT_THAT(motion.message, says_so);
  } else {
    EXPECT_THAT(motion.message, Not(HasSubstr("times as far as the motion with forces alone")));
  }
}
TEST(MaterialBodies, SampleFlowerWithBothEndsFreeIsNotThrownAbout) {
  expect_no_wild_motion(BodyTask::kBothEndsFree);
}
TEST(MaterialBodies, SampleFlowerThatFloatsIsNotThrownAbout) {
  expect_no_wild_motion(BodyTask::kFreeBody);
}

}  // namespace
}  // namespace limber::session
