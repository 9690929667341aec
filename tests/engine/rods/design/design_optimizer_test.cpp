#include "engine/rods/design/design_optimizer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/deployment.h"
#include "tests/engine/rods/equilibrium/small_linkages.h"

namespace limber::rods {
namespace {

/// A linkage, and where its joints are when it is deployed with other rest lengths: a target that
/// can be reached.
struct Known {
  Known() : model(testing::curved_model()), state(model) {
    LinkageEquilibrium equilibrium(model);
    flat.pins = {{5}};
    EXPECT_TRUE(equilibrium.solve(state, flat).converged());
    deployed = flat;
    deployed.mean_opening_angle = state.mean_opening_angle() + 0.4;
    LinkageState open = state;
    EXPECT_EQ(deploy(equilibrium, open, deployed).status, DeploymentStatus::kReached);
    start.emplace(DesignPoint{model.segment_lengths(), state, open});
    Random random(17);
    Eigen::VectorXd other = model.segment_lengths();
    for (double& length : other) length *= random.uniform(0.97, 1.03);
    LinkageDesign design(model, flat, deployed, *start, {});
    for (int k = 1; k <= 10; ++k) {
      const DesignTrial trial =
          design.trial(model.segment_lengths() + 0.1 * k * (other - model.segment_lengths()));
      EXPECT_EQ(trial.status, TrialStatus::kFound) << trial.message;
      design.move_to(trial.point);
    }
    const auto& joints = design.point().deployed.joints();
    for (int j = 0; j < model.variables().joints(); ++j)
      criteria.targets.push_back({j, joints[static_cast<std::size_t>(j)].position, 1});
    criteria.distance_weight = 1e8;
    criteria.plane = Plane{};  // the flat shape lies beside it, so that its height may press
    options.flat_height = 0.2;
  }
  [[nodiscard]] LinkageDesign design() const { return {model, flat, deployed, *start, criteria}; }
  /// Root mean square distance of the joints from their targets.
  [[nodiscard]] double distance(const DesignValues& values) const {
    return std::sqrt(2 * values.distance / model.variables().joints());
  }

  LinkageModel model;
  LinkageState state;
  Conditions flat, deployed;
  std::optional<DesignPoint> start;
  DesignCriteria criteria;
  DesignOptimizerOptions options;
};

TEST(DesignOptimizer, FindsATargetThatIsKnownToBeReachable) {
  Known known;
  LinkageDesign design = known.design();
  int steps = 0;
  double last = std::numeric_limits<double>::infinity();
  const DesignReport report = optimize_design(
      design, known.options, {}, [&](const DesignProgress& progress, LinkageDesign&) {
        ++steps;
        EXPECT_LE(progress.values.objective, last * (1 + 1e-9));
        last = progress.values.objective;
      });
  EXPECT_TRUE(report.status == DesignStatus::kConverged || report.status == DesignStatus::kSettled)
      << report.message;
  EXPECT_EQ(steps, report.iterations);
  EXPECT_LT(known.distance(report.after), known.distance(report.before) / 50);
  EXPECT_LE(report.flat_height, known.options.flat_height * 1.001);
  EXPECT_EQ(design.values(design.point()).objective, report.after.objective);
}

TEST(DesignOptimizer, KeepsTheSmallestAngleAtItsBound) {
  Known known;
  LinkageDesign free = known.design();
  const DesignReport unbound = optimize_design(free, known.options);
  LinkageDesign design = known.design();
  DesignOptimizerOptions options = known.options;
  options.smallest_angle =
      std::max(unbound.after.smallest_angle, unbound.before.smallest_angle) + 0.01;
  const DesignReport report = optimize_design(design, options);
  EXPECT_GE(report.after.smallest_angle, options.smallest_angle - 2e-3) << report.message;
  EXPECT_GT(report.after.objective, unbound.after.objective);
}

/// A search that begins where one has converged gains next to nothing.
void expect_optimum(LinkageDesign& design, const DesignOptimizerOptions& options) {
  const DesignReport again = optimize_design(design, options);
  EXPECT_GT(again.after.objective, 0.98 * again.before.objective) << again.message;
}

TEST(DesignOptimizer, AConstraintHoldsADesignOffNoMoreThanItMust) {
  for (const double weight : {1e6, 1e8}) {
    Known known;
    known.criteria.distance_weight = weight;
    LinkageDesign free = known.design();
    const DesignReport unbound = optimize_design(free, known.options);
    LinkageDesign design = known.design();
    DesignOptimizerOptions options = known.options;
    options.smallest_angle =
        std::max(unbound.after.smallest_angle, unbound.before.smallest_angle) + 0.01;
    const DesignReport report = optimize_design(design, options);
    EXPECT_GE(report.after.smallest_angle, options.smallest_angle - 2e-3) << report.message;
    if (report.status == DesignStatus::kConverged) {
      EXPECT_LE(report.after.smallest_angle, options.smallest_angle + 2e-3) << report.message;
      expect_optimum(design, options);
    }
  }
}

TEST(DesignOptimizer, KeepsALinkageFlatEnough) {
  Known known;
  LinkageDesign free = known.design();
  const DesignReport unbound = optimize_design(free, known.options);
  LinkageDesign design = known.design();
  DesignOptimizerOptions options = known.options;
  options.flat_height = 0.97 * unbound.flat_height;
  const DesignReport report = optimize_design(design, options);
  EXPECT_LE(report.flat_height, options.flat_height * 1.001) << report.message;
  EXPECT_GT(report.after.objective, unbound.after.objective);
  EXPECT_LT(known.distance(report.after), known.distance(report.before));
}

TEST(DesignOptimizer, EndsAtTheBestThatKeepsTheConstraints) {
  for (const BucklingGuard guard : {BucklingGuard::kNever, BucklingGuard::kFromStart}) {
    Known known;
    known.criteria.distance_weight = 1e5;
    LinkageDesign free = known.design();
    DesignOptimizerOptions options = known.options;
    options.flat_height = 0.97 * optimize_design(free, options).flat_height;
    options.guard = guard;
    LinkageDesign design = known.design();
    double best = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 2; ++round) {
      const DesignReport report =
          optimize_design(design, options, {}, [&](const DesignProgress& progress, LinkageDesign&) {
            if (progress.flat_height <= options.flat_height)
              best = std::min(best, progress.values.objective);
          });
      EXPECT_LE(report.flat_height, options.flat_height * 1.001) << report.message;
      EXPECT_LE(report.after.objective, best * (1 + 1e-12)) << report.message;
    }
  }
}

TEST(DesignOptimizer, RestLengthsStayWithinTheirBounds) {
  Known known;
  LinkageDesign design = known.design();
  DesignOptimizerOptions options = known.options;
  options.shortest = 0.99;
  options.longest = 1.01;
  const Eigen::VectorXd start = design.point().lengths;
  const DesignReport report = optimize_design(design, options);
  const Eigen::ArrayXd share = design.point().lengths.cwiseQuotient(start).array();
  EXPECT_GE(share.minCoeff(), 0.99 - 1e-12);
  EXPECT_LE(share.maxCoeff(), 1.01 + 1e-12);
  EXPECT_FALSE(report.at_bound.empty());
  EXPECT_LT(report.after.distance, 0.5 * report.before.distance);
}

TEST(DesignOptimizer, ATargetThatCannotBeReachedEndsAtTheNearestThereIs) {
  Known known;
  for (JointTarget& target : known.criteria.targets) target.position.z() += 500;
  LinkageDesign design = known.design();
  const DesignReport report = optimize_design(design, known.options);
  EXPECT_NE(report.status, DesignStatus::kConverged);
  EXPECT_TRUE(std::isfinite(report.after.objective));
  EXPECT_LE(report.after.objective, report.before.objective);
  EXPECT_FALSE(report.message.empty());
}

TEST(DesignOptimizer, StopsWhenAskedToAndKeepsTheBest) {
  Known known;
  LinkageDesign design = known.design();
  JobContext context;
  const DesignReport report = optimize_design(
      design, known.options, context,
      [&](const DesignProgress&, LinkageDesign&) { context.cancellation.request(); });
  EXPECT_EQ(report.status, DesignStatus::kCancelled);
  EXPECT_EQ(report.iterations, 1);
  EXPECT_EQ(design.values(design.point()).objective, report.after.objective);
}

TEST(DesignOptimizer, CriteriaMayChangeWhileItRuns) {
  // The weight falls by orders of magnitude: measured by the old goal everything is small then.
  for (const double weight : {1e3, 1.0}) {
    Known known;
    known.options.tolerance = 1e-4;
    LinkageDesign design = known.design();
    const DesignReport report = optimize_design(
        design, known.options, {}, [&](const DesignProgress& progress, LinkageDesign& running) {
          if (progress.iteration != 1) return;
          DesignCriteria criteria = running.criteria();
          criteria.distance_weight = weight;
          running.set_criteria(criteria);
        });
    EXPECT_EQ(design.criteria().distance_weight, weight);
    EXPECT_NE(report.status, DesignStatus::kStuck) << report.message;
    known.criteria.distance_weight = weight;
    known.criteria.energy_scale = design.criteria().energy_scale;
    LinkageDesign anew = known.design();
    const DesignReport whole = optimize_design(anew, known.options);
    EXPECT_LT(report.after.objective, 1.1 * whole.after.objective) << weight << report.message;
  }
}

TEST(DesignOptimizer, BadOptionsAreNamed) {
  const auto field = [](const auto& spoil) -> std::string {
    DesignOptimizerOptions options;
    spoil(options);
    try {
      options.validate();
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(field([](DesignOptimizerOptions& o) { o.max_iterations = 0; }), "max_iterations");
  EXPECT_EQ(field([](DesignOptimizerOptions& o) { o.shortest = 1; }), "shortest");
  EXPECT_EQ(field([](DesignOptimizerOptions& o) { o.longest = 0.5; }), "longest");
  EXPECT_EQ(field([](DesignOptimizerOptions& o) { o.flat_height = -1; }), "flat_height");
  EXPECT_EQ(field([](DesignOptimizerOptions& o) { o.first_radius = 2; }), "first_radius");
  EXPECT_EQ(field([](DesignOptimizerOptions&) {}), "none");
}

}  // namespace
}  // namespace limber::rods
