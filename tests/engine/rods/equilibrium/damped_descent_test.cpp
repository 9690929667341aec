#include "engine/rods/equilibrium/damped_descent.h"

#include <gtest/gtest.h>

#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using detail::DampedDescent;
using testing::curved_model;
using testing::joint_distance;

/// A joint pressed towards another, and the equilibrium without that.
class Pushed : public ::testing::Test {
 protected:
  void SetUp() override {
    free.pins = {{5}};
    ASSERT_TRUE(equilibrium.solve(rest, free).converged());
    state = rest;
    Conditions held = free;
    const Eigen::Vector3d there = rest.joints()[10].position;
    held.pins.push_back({10, Hold::kMotion, there + 0.3 * (rest.joints()[5].position - there)});
    ASSERT_TRUE(equilibrium.solve(state, held).converged());
    reactions = equilibrium.reactions(state, held);
  }
  DampedDescent::End descend(DampedDescent& descent, const DampedDescent::OnStep& on_step,
                             const JobContext& job = {}) {
    EquilibriumOptions options;
    options.tolerance = 1e-6;
    return descent.run(state, options, job, on_step, [](const EquilibriumReport&) {});
  }
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium{model};
  LinkageState rest{model}, state{model};
  Conditions free;
  std::vector<JointLoad> reactions;
};

TEST_F(Pushed, GoesDownInSmallStepsToTheEquilibrium) {
  DampedDescent descent(equilibrium, free);
  descent.take_over(reactions);
  double energy = std::numeric_limits<double>::infinity();
  LinkageState before = state;
  const double whole = joint_distance(state, rest);
  const auto end = descend(descent, [&](const DampedDescent::Step& step, const LinkageState& now) {
    EXPECT_LE(step.report.energies.total(), energy * (1 + 1e-9));
    energy = step.report.energies.total();
    EXPECT_FALSE(step.jumped);
    EXPECT_LT(joint_distance(now, before), 0.5 * whole);
    before = now;
  });
  EXPECT_EQ(end, DampedDescent::End::kThere);
  EXPECT_LT(joint_distance(state, rest), 1e-2 * whole);
  EXPECT_TRUE(equilibrium.solve(state, free).converged());
  EXPECT_LT(joint_distance(state, rest), 1e-4 * whole);
}

TEST_F(Pushed, WhatItEndsInIsHeldBySpringsThatHardlyPull) {
  DampedDescent descent(equilibrium, free);
  ASSERT_EQ(descend(descent, [](const DampedDescent::Step&, const LinkageState&) {}),
            DampedDescent::End::kThere);
  LinkageState held = state;
  const EquilibriumReport report = equilibrium.solve(held, descent.held());
  EXPECT_TRUE(report.converged());
  EXPECT_LT(joint_distance(held, state), 1e-3 * joint_distance(rest, LinkageState(model)) + 1e-3);
  EXPECT_LT(report.spring_energy, 1e-3 * report.energies.total());
}

TEST_F(Pushed, IsCancelledBetweenIterations) {
  const Cancellation cancellation;
  DampedDescent descent(equilibrium, free);
  int steps = 0;
  const auto end = descend(descent,
                           [&](const DampedDescent::Step&, const LinkageState&) {
                             if (++steps == 2) cancellation.request();
                           },
                           {cancellation, {}});
  EXPECT_EQ(end, DampedDescent::End::kCancelled);
  EXPECT_EQ(steps, 2);
}

}  // namespace
}  // namespace limber::rods
