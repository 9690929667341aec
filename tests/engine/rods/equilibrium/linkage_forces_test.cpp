// Forces in an equilibrium balance, one by one and in sum.
#include "engine/rods/equilibrium/linkage_forces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

/// Largest sum of what acts on a joint: segments, loads, springs at the joint, reactions.
double worst_joint(const LinkageModel& model, const LinkageForces& forces,
                   const Conditions& conditions) {
  Eigen::Matrix3Xd sums = forces.loads + forces.reaction_forces;
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (const End end : {kStart, kFinish}) {
      const int joint = model.graph().segments[s].joints[end];
      if (joint >= 0) sums.col(joint) += forces.end_forces.col(2 * s + end);
    }
  }
  for (std::size_t i = 0; i < conditions.springs.size(); ++i) {
    if (const auto* const joint = std::get_if<JointPoint>(&conditions.springs[i].at))
      sums.col(joint->joint) += forces.springs[i].force;
  }
  return sums.colwise().norm().maxCoeff();
}

/// A curved grid under all that forces come from.
Conditions everything(const LinkageModel& model) {
  const LinkageState drawn(model);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}, {15}};
  conditions.mean_opening_angle = 0.7;
  conditions.springs = {
      {JointPoint{5}, drawn.joints()[5].position + Eigen::Vector3d(0, 0, 20), 0.05},
      {ArcPoint{3, 0.4}, {30, 60, 20}, 0.05},
      {ArcPoint{7, 0.02}, {60, 60, 0}, 0.05}};
  conditions.loads = {{9, {0.1, 0.2, -0.1}, {0, 0, 0}, 0.3}, {6, {0, 0, 0.2}, {0, 0, 0}, 0}};
  return conditions;
}

TEST(LinkageForces, SumsOfReactionsLoadsSpringsAndWeightVanish) {
  const LinkageModel model = testing::curved_model();
  for (const double weight : {0.0, 1e-3}) {
    Conditions conditions = everything(model);
    conditions.gravity = {Eigen::Vector3d(0, 0, -9.81), weight};
    LinkageState state(model);
    const EquilibriumReport report = LinkageEquilibrium(model).solve(state, conditions);
    ASSERT_TRUE(report.converged()) << report.message;
    const LinkageForces forces = forces_in(model, state, conditions);
    Eigen::Vector3d sum = forces.loads.rowwise().sum() + forces.reaction_forces.rowwise().sum() +
                          forces.weights.rowwise().sum();
    double largest = forces.reaction_forces.colwise().norm().maxCoeff();
    for (const auto& spring : forces.springs) {
      sum += spring.force;
      largest = std::max(largest, spring.force.norm());
    }
    ASSERT_GT(largest, 0.1);
    EXPECT_LT(sum.norm(), 1e-6 * largest);
    EXPECT_LT(worst_joint(model, forces, conditions), 1e-6 * largest);
    EXPECT_LT(forces.unbalanced_forces.colwise().norm().maxCoeff(), 1e-6 * largest);
    // A segment passes on what acts on it.
    for (int s = 0; s < model.variables().segments(); ++s) {
      Eigen::Vector3d on_it = forces.weights.col(s);
      if (s == 3) on_it += forces.springs[1].force;
      if (s == 7) on_it += forces.springs[2].force;
      const Eigen::Vector3d passed =
          forces.end_forces.col(2 * s) + forces.end_forces.col(2 * s + 1);
      EXPECT_LT((passed - on_it).norm(), 1e-6 * largest) << s;
    }
    EXPECT_NEAR(forces.opening_moment, report.mean_angle_moment,
                1e-6 * std::abs(report.mean_angle_moment));
    if (weight > 0) continue;
    Eigen::Vector3d moments = forces.reaction_moments.rowwise().sum();
    for (int j = 0; j < 16; ++j) {
      moments += state.joints()[j].position.cross(
          Eigen::Vector3d(forces.loads.col(j) + forces.reaction_forces.col(j)));
    }
    for (const auto& spring : forces.springs) moments += spring.point.cross(spring.force);
    EXPECT_LT(moments.norm(), 1e-6 * largest * 120);
  }
}

/// Springs at shares of segments whose edges at joints are of other lengths than those between.
TEST(LinkageForces, ASpringHasTheForceOfItsEnergy) {
  const LinkageModel model = testing::gapped_model(10, 6);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}};
  for (const double share : {0.0, 0.07, 0.3, 0.93, 1.0}) {
    conditions.springs = {{ArcPoint{8, share}, {150, 60, 30}, 20}};
    LinkageState state(model);
    const EquilibriumReport report = LinkageEquilibrium(model).solve(state, conditions);
    ASSERT_TRUE(report.converged()) << report.message;
    const LinkageForces forces = forces_in(model, state, conditions);
    EXPECT_NEAR(forces.springs[0].force.squaredNorm(), 2 * 20 * report.spring_energy,
                1e-9 * report.spring_energy);
    EXPECT_LT((forces.reaction_forces.col(0) + forces.springs[0].force).norm(),
              1e-6 * forces.springs[0].force.norm());
  }
}

}  // namespace
}  // namespace limber::rods
