#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <optional>

#include "engine/base/random.h"
#include "engine/rods/design/linkage_design.h"
#include "engine/rods/equilibrium/deployment.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods::testing {

/// Of length 1.
inline Eigen::VectorXd random_direction(Eigen::Index size, unsigned seed) {
  Random random(seed);
  Eigen::VectorXd v(size);
  for (double& value : v) value = random.normal();
  return v / v.norm();
}

/// Parameters times random factors near 1.
inline Eigen::VectorXd varied(Eigen::VectorXd parameters, double share, unsigned seed) {
  Random random(seed);
  for (double& value : parameters) value *= random.uniform(1 - share, 1 + share);
  return parameters;
}

/// Leads a design to other parameters in so many equal steps.
inline void lead(LinkageDesign& design, const Eigen::VectorXd& parameters, int steps) {
  const Eigen::VectorXd from = design.parameters();
  for (int k = 1; k <= steps; ++k) {
    const DesignTrial trial =
        design.trial(from + static_cast<double>(k) / steps * (parameters - from));
    ASSERT_EQ(trial.status, TrialStatus::kFound) << trial.message;
    design.move_to(trial.point);
  }
}

inline Conditions held_at(int joint) {
  Conditions conditions;
  conditions.pins = {{joint}};
  return conditions;
}

/// A linkage and both of its equilibria: held, and opened by its mean angle.
struct SmallDesign {
  /// @param opening  by how much the mean angle opens [rad]
  /// @param tolerance  of equilibria, at the start and of trials
  SmallDesign(const LinkageModel& linkage, const Conditions& held, double opening,
              double tolerance = 1e-12)
      : model(linkage), flat(held), deployed(held) {
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    EXPECT_TRUE(equilibrium.solve(state, flat, {.tolerance = tolerance}).converged());
    deployed.mean_opening_angle = state.mean_opening_angle() + opening;
    LinkageState open = state;
    EXPECT_EQ(deploy(equilibrium, open, deployed).status, DeploymentStatus::kReached);
    start.emplace(DesignPoint{model.segment_lengths(), state, open});
    limits.equilibrium.tolerance = tolerance;
  }
  [[nodiscard]] LinkageDesign design(DesignVariables variables = {}) const {
    return {model, flat, deployed, *start, criteria, limits, variables};
  }

  LinkageModel model;
  Conditions flat, deployed;
  std::optional<DesignPoint> start;
  DesignCriteria criteria;
  DesignLimits limits;
};

/// A strip of cells that lies almost flat before it is deployed, beside the plane that it is
/// measured by; two of its joints have targets.
inline SmallDesign curved_design() {
  SmallDesign problem(curved_model(), held_at(5), 0.4);
  problem.criteria.targets = {{0, {10, -5, 20}, 0.5}, {15, {130, 100, -10}, 2}};
  problem.criteria.distance_weight = 3;
  problem.criteria.plane = Plane{{0, 0, 1}, {0.1, 0.2, 1}};
  return problem;
}

}  // namespace limber::rods::testing
