// Lengths that an edit interrupts along the path.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <numbers>

#include "engine/rods/linkage/joint_positions.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/live_linkage.h"
#include "tests/engine/rods/linkage/linkage_files.h"

namespace limber::session {
namespace {

constexpr int kRods = 5;
constexpr double kLonger = 1.05;

/// Crossing rods with joints 1 m apart: lies flat, and opens for nothing.
scene::Linkage grid() {
  scene::Linkage linkage;
  linkage.section = rods::Rectangle{0.05, 0.01};
  linkage.lines = rods::testing::sheared_grid(kRods, kRods, std::numbers::pi / 2);
  return linkage;
}

/// All lengths as wanted, with the first so many corners held where they are.
std::shared_ptr<const scene::LinkageConditions> held_at(int corners, double length) {
  auto conditions = std::make_shared<scene::LinkageConditions>();
  const int all[] = {0, kRods - 1, kRods * (kRods - 1), kRods * kRods - 1};
  for (int c = 0; c < corners; ++c) conditions->pins.push_back({all[c], scene::Held::kMotion, {}});
  if (length != 1)
    conditions->segment_lengths = Eigen::VectorXd::Constant(2 * kRods * (kRods - 1), length);
  return conditions;
}

double first_distance(const LiveLinkage& live) {
  const Eigen::Matrix3Xd joints = rods::joint_positions(live.state());
  return (joints.col(0) - joints.col(1)).norm();
}

/// Interrupted within the last step, the sizes are there and the shape is not.
TEST(InterruptedSizes, AreNotTakenForReached) {
  for (int last = 1; last <= 3; ++last) {
    for (const int corners : {0, 1, 3}) {
      SCOPED_TRACE(::testing::Message() << "step " << last << ", corners " << corners);
      LiveLinkage live(grid());
      ASSERT_TRUE(live.solve(held_at(4, 1), {}, [] {}).reached);
      // Part of the path: held apart as it is, the grid may take long or buckle.
      Cancellation first;
      ASSERT_FALSE(live.solve(held_at(4, kLonger), {first, {}}, [&] { first.request(); }).reached);
      Cancellation cancellation;
      int steps = 0;
      const auto interrupted = live.solve(held_at(corners, kLonger), {cancellation, {}}, [&] {
        if (++steps == last) cancellation.request();
      });
      EXPECT_FALSE(interrupted.reached);
      const auto free = live.solve(held_at(0, kLonger), {}, [] {});
      ASSERT_TRUE(free.reached) << free.report.message;
      EXPECT_NEAR(first_distance(live), kLonger, 1e-6);
      EXPECT_EQ(live.sizes().segments.minCoeff(), kLonger);
    }
  }
}

/// Thinner rods would let the joint turn over: neither on the interrupted path nor back from there.
TEST(InterruptedSizes, TurnNoJointOver) {
  constexpr int kJoint = 4;
  scene::Linkage linkage = scene::make_linkage_sample("grid");
  linkage.lines = rods::testing::sheared_grid(3, 3, std::numbers::pi / 2);
  linkage.conditions = {};
  for (const int steps_until : {1, 2, 3}) {
    SCOPED_TRACE(steps_until);
    LiveLinkage live(linkage);
    scene::LinkageConditions conditions;
    for (int j = 0; j < 9; ++j)
      if (j != kJoint) conditions.pins.push_back({j, scene::Held::kMotion, {}});
    const auto bring = [&](double scale, const JobContext& job, const std::function<void()>& on) {
      conditions.section_scales = Eigen::VectorXd::Constant(12, scale);
      return live.solve(std::make_shared<scene::LinkageConditions>(conditions), job, on);
    };
    for (double torque = 50;; torque *= 1.15) {  // as much as it bears
      ASSERT_LT(torque, 1e4);
      const auto borne = conditions.loads;
      conditions.loads = {{kJoint, {0, 0, 0}, {0, 0, 0}, torque}};
      if (bring(1, {}, [] {}).reached) continue;
      conditions.loads = borne;
      break;
    }
    ASSERT_TRUE(bring(1, {}, [] {}).reached);
    const double angle = live.state().joints()[kJoint].opening_angle;
    ASSERT_LT(angle, 3.1);
    Cancellation cancellation;
    int steps = 0;
    (void)bring(0.93, {cancellation, {}}, [&] {
      if (++steps == steps_until) cancellation.request();
    });
    live.stay_near();
    const LiveLinkage::Outcome back = bring(1, {}, [] {});
    ASSERT_TRUE(back.reached) << back.report.message;
    EXPECT_NEAR(live.state().joints()[kJoint].opening_angle, angle, 1e-6);
  }
}

}  // namespace
}  // namespace limber::session
