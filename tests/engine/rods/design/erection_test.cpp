#include "engine/rods/design/erection.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/rods/design/starting_grid.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "tests/engine/rods/design/small_patches.h"

namespace limber::rods {
namespace {

constexpr Rectangle kWideStrip{4, 1};

/// A grid that lies in its plane without stress, and opens to either side of it.
struct Dome {
  explicit Dome(double side)
      : grid(starting_grid(
            testing::field(12, [](double x, double y) { return 15 * (1 - x * x - y * y); }),
            {.columns = 5, .rows = 5, .section = kWideStrip})),
        model(build_linkage_graph(grid.flat), 4, stiffness()),
        point{model.segment_lengths(), LinkageState(model), LinkageState(model), {}, {}} {
    flat.pins = deployed.pins = {{12}};
    flat.mean_opening_angle = point.flat.mean_opening_angle();
    deployed.mean_opening_angle = grid.mean_angle;
    Conditions pushed = deployed;
    for (Eigen::Index j = 0; j < grid.push.size(); ++j)
      pushed.loads.push_back({static_cast<int>(j), {0, 0, side * grid.push[j]}});
    LinkageEquilibrium equilibrium(model);
    EXPECT_TRUE(equilibrium.solve(point.flat, flat).converged());
    point.deployed = point.flat;
    for (const auto& [from, to] : {std::pair(flat, pushed), std::pair(pushed, deployed)})
      EXPECT_EQ(deploy(equilibrium, point.deployed, from, to).status, DeploymentStatus::kReached);
  }
  static RodStiffness stiffness() {
    const SectionStiffness rods = section_stiffness(section_properties(kWideStrip), {1, 0.3});
    return {rods.stretching, rods.bending_1, rods.bending_2, rods.torsion};
  }
  [[nodiscard]] LinkageState opened(const std::vector<JointLoad>& push) const {
    LinkageEquilibrium equilibrium(model);
    LinkageState state = point.flat;
    Conditions held = flat;
    for (const Conditions& stage : erection_stages(point.flat, deployed, push)) {
      EXPECT_EQ(deploy(equilibrium, state, held, stage).status, DeploymentStatus::kReached);
      held = stage;
    }
    EXPECT_TRUE(held.loads.empty());
    return state;
  }

  StartingGrid grid;
  LinkageModel model;
  Conditions flat, deployed;
  DesignPoint point;
};

TEST(Erection, OfAFlatGridIsAPushToTheSideThatItWasDesignedFor) {
  for (const double side : {1.0, -1.0}) {  // the surface's side, and the mirrored one
    const Dome dome(side);
    const ErectionSearch search = find_erection(dome.model, dome.flat, dome.deployed, dome.point);
    ASSERT_TRUE(search.found) << search.message;
    const Erection& erection = *search.found;
    EXPECT_EQ(erection.push.size(), 25U) << "in its plane it selects a side by rounding";
    EXPECT_DOUBLE_EQ(erection.mean_angle, *dome.deployed.mean_opening_angle);
    EXPECT_DOUBLE_EQ(erection.flat_angle, *dome.flat.mean_opening_angle);
    EXPECT_LT(erection.distance, 1e-4 * 280);
    // What a builder has to apply on the way is part of the plan.
    ASSERT_EQ(erection.angles.size(), erection.moments.size());
    ASSERT_GE(erection.angles.size(), 3U);
    EXPECT_NEAR(erection.angles.front(), erection.flat_angle, 1e-9);
    EXPECT_NEAR(erection.angles.back(), erection.mean_angle, 1e-9);
    LinkageEquilibrium equilibrium(dome.model);
    LinkageState open = dome.point.deployed;
    EXPECT_NEAR(erection.moments.back(), equilibrium.solve(open, dome.deployed).mean_angle_moment,
                1e-3 * std::abs(erection.moments.back()));
    EXPECT_GT(std::abs(erection.moments.back()), 0);
    ASSERT_TRUE(erection.support);
    EXPECT_EQ(erection.support->joint, 12) << "its pin";
    EXPECT_GT(erection.support->moment.norm() + erection.support->force.norm(), 0);
    EXPECT_EQ(erection.flat.cols(), 25);
    EXPECT_LT(distance_between_shapes(erection.open, joint_positions(dome.point.deployed)), 1e-2);
    EXPECT_LT(distance_between_shapes(dome.opened(erection.push), dome.point.deployed), 1e-3);
    // With the opposite push it opens to the mirrored shape: that is another one.
    std::vector<JointLoad> against = erection.push;
    for (JointLoad& load : against) load.force *= -1;
    EXPECT_GT(distance_between_shapes(dome.opened(against), dome.point.deployed), 5);
  }
}

TEST(Erection, WhereNoneLeadsToTheShapeTheMessageSaysHowFarItIs) {
  Dome dome(1);
  dome.point.deployed = dome.point.flat;  // no equilibrium at the angle that it is opened to
  const ErectionSearch search = find_erection(dome.model, dome.flat, dome.deployed, dome.point);
  EXPECT_FALSE(search.found);
  EXPECT_NE(search.message.find("another shape"), std::string::npos) << search.message;
}

TEST(Erection, WithoutAMeanAngleNoneIsLookedForAndTheMessageSaysSo) {
  Dome dome(1);
  dome.deployed.mean_opening_angle.reset();
  const ErectionSearch search = find_erection(dome.model, dome.flat, dome.deployed, dome.point);
  EXPECT_FALSE(search.found);
  EXPECT_NE(search.message.find("no mean angle is set"), std::string::npos) << search.message;
}

TEST(Erection, CancelledItThrows) {
  const Dome dome(1);
  JobContext job;
  job.cancellation.request();
  EXPECT_THROW((void)find_erection(dome.model, dome.flat, dome.deployed, dome.point, job), Error);
}

TEST(Erection, WhatNoPinHoldsIsHeldAtItsMiddleWhileItIsPushed) {
  const Dome dome(1);
  Conditions free = dome.deployed;
  free.pins.clear();
  const auto stages = erection_stages(dome.point.flat, free, {{3, {0, 0, 1}}});
  ASSERT_EQ(stages.size(), 3U);
  ASSERT_EQ(stages[0].pins.size(), 1U);
  EXPECT_EQ(stages[0].pins[0].joint, 12);
  EXPECT_EQ(stages[1].loads.size(), 1U);
  EXPECT_TRUE(stages[2].pins.empty());
  EXPECT_EQ(erection_stages(dome.point.flat, free, {{3, {0, 0, 1}}}, 7)[1].pins[0].joint, 7)
      << "or where it was held when the push was found";
  EXPECT_TRUE(stages[2].loads.empty());
}

}  // namespace
}  // namespace limber::rods
