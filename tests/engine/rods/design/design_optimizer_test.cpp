#include "engine/rods/design/design_optimizer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/rods/design/design_rank.h"
#include "tests/engine/rods/design/small_designs.h"

namespace limber::rods {
namespace {

/// A linkage, and where its joints are when it is deployed with other rest lengths: a target that
/// can be reached.
struct ReachableDesign : testing::SmallDesign {
  ReachableDesign() : SmallDesign(testing::curved_model(), testing::held_at(5), 0.4, 1e-10) {
    LinkageDesign design = this->design();
    testing::lead(design, testing::varied(design.parameters(), 0.03, 17), 10);
    const auto& joints = design.point().deployed.joints();
    for (int j = 0; j < model.variables().joints(); ++j)
      criteria.targets.push_back({j, joints[static_cast<std::size_t>(j)].position, 1});
    criteria.distance_weight = 1e8;
    criteria.plane = Plane{};  // the flat shape lies beside it, so that its height may press
    options.flat_height = 0.2;
  }
  /// Root mean square distance of the joints from their targets.
  [[nodiscard]] double distance(const DesignValues& values) const {
    return std::sqrt(2 * values.distance / model.variables().joints());
  }

  DesignOptimizerOptions options;
};

/// Which of these a search ends by, last digits can turn.
bool is_optimum(DesignStatus status) {
  return status == DesignStatus::kConverged || status == DesignStatus::kSettled;
}
bool is_given_up(DesignStatus status) {
  return status == DesignStatus::kInfeasible || status == DesignStatus::kStuck;
}

TEST(DesignOptimizer, FindsATargetThatIsKnownToBeReachable) {
  ReachableDesign known;
  LinkageDesign design = known.design();
  int steps = 0;
  double last = std::numeric_limits<double>::infinity();
  const DesignReport report = optimize_design(
      design, known.options, {}, [&](const DesignProgress& progress, LinkageDesign&) {
        ++steps;
        EXPECT_LE(progress.values.objective, last * (1 + 1e-9));
        last = progress.values.objective;
      });
  EXPECT_TRUE(is_optimum(report.status)) << report.message;
  EXPECT_EQ(steps, report.iterations);
  EXPECT_LT(known.distance(report.after), known.distance(report.before) / 50);
  EXPECT_LE(report.flat_height, known.options.flat_height * 1.001);
  EXPECT_EQ(design.values(design.point()).objective, report.after.objective);
}

/// A search without a bound on angles, and one whose bound presses from its start to its end.
struct AngleBound {
  explicit AngleBound(const ReachableDesign& known)
      : options(known.options), design(known.design()) {
    LinkageDesign free = known.design();
    unbound = optimize_design(free, options);
    options.smallest_angle =
        std::max(unbound.after.smallest_angle, unbound.before.smallest_angle) + 0.01;
    report = optimize_design(design, options);
    EXPECT_GE(report.after.smallest_angle, options.smallest_angle - 2e-3) << report.message;
  }
  DesignOptimizerOptions options;
  LinkageDesign design;
  DesignReport unbound, report;
};

TEST(DesignOptimizer, KeepsTheSmallestAngleAtItsBound) {
  const AngleBound bound{ReachableDesign()};
  EXPECT_GT(bound.report.after.objective, bound.unbound.after.objective);
}

TEST(DesignOptimizer, KeepsTheAreaOfTheDeployedCells) {
  ReachableDesign known;
  LinkageDesign free = known.design();
  const DesignReport unbound = optimize_design(free, known.options);
  const double area = unbound.after.deployed_area;
  known.criteria.least_area = 1.02 * std::max(area, unbound.before.deployed_area);
  LinkageDesign design = known.design();
  const DesignReport kept = optimize_design(design, known.options);
  EXPECT_TRUE(is_optimum(kept.status)) << kept.message;
  EXPECT_GE(kept.after.deployed_area, known.criteria.least_area * (1 - DesignRank::kHolds));
  EXPECT_LT(kept.after.deployed_area, known.criteria.least_area * 1.002) << "it presses";
  EXPECT_GT(kept.after.objective, unbound.after.objective);
}

TEST(DesignOptimizer, AnAreaThatCannotBeKeptIsReported) {
  ReachableDesign known;
  LinkageDesign start = known.design();
  known.criteria.least_area = 4 * start.values(start.point()).deployed_area;
  known.options.longest = 1.2;
  LinkageDesign design = known.design();
  const DesignReport report = optimize_design(design, known.options);
  EXPECT_TRUE(is_given_up(report.status)) << report.message;
  EXPECT_LT(report.after.deployed_area, known.criteria.least_area * (1 - DesignRank::kHolds));
  EXPECT_NE(report.message.find("the deployed linkage covers"), std::string::npos)
      << report.message;
}

/// A search that begins where one has converged gains next to nothing.
void expect_optimum(LinkageDesign& design, const DesignOptimizerOptions& options) {
  const DesignReport again = optimize_design(design, options);
  EXPECT_GT(again.after.objective, 0.98 * again.before.objective) << again.message;
}

TEST(DesignOptimizer, AConstraintHoldsADesignOffNoMoreThanItMust) {
  int converged = 0;
  for (const double weight : {1e6, 1e8}) {
    ReachableDesign known;
    known.criteria.distance_weight = weight;
    AngleBound bound(known);
    const DesignReport& report = bound.report;
    if (report.status != DesignStatus::kConverged) continue;
    ++converged;
    EXPECT_LE(report.after.smallest_angle, bound.options.smallest_angle + 2e-3) << report.message;
    expect_optimum(bound.design, bound.options);
  }
  EXPECT_GT(converged, 0);
}

TEST(DesignOptimizer, KeepsALinkageFlatEnough) {
  ReachableDesign known;
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
    ReachableDesign known;
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
  ReachableDesign known;
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
  ReachableDesign known;
  for (JointTarget& target : known.criteria.targets) target.position.z() += 50;
  known.options.tolerance = 1e-6;
  known.options.least_gain = 1e-9;
  double nearest = 0;
  for (const unsigned seed : {0U, 1U, 2U, 3U}) {
    LinkageDesign design = known.design();
    if (seed > 0) testing::lead(design, testing::varied(design.parameters(), 0.01, seed), 5);
    const double slope = design.gradients().objective.norm();
    const DesignReport report = optimize_design(design, known.options);
    EXPECT_TRUE(is_optimum(report.status)) << report.message;
    const double gained = report.before.objective - report.after.objective;
    EXPECT_GT(gained, 0);
    // Neither bounds nor constraints hold it: what is left of the slope is all there is.
    EXPECT_TRUE(report.at_bound.empty());
    EXPECT_LT(report.flat_height, known.options.flat_height);
    EXPECT_LT(design.gradients().objective.norm(), 1e-3 * slope);
    if (seed == 0) nearest = report.after.objective;
    EXPECT_NEAR(report.after.objective, nearest, 1e-4 * gained) << seed;
    EXPECT_GT(known.distance(report.after), 10);
  }
}

TEST(DesignOptimizer, ATargetFarBeyondReachIsApproached) {
  ReachableDesign known;
  for (JointTarget& target : known.criteria.targets) target.position.z() += 500;
  LinkageDesign design = known.design();
  const DesignReport report = optimize_design(design, known.options);
  EXPECT_NE(report.status, DesignStatus::kConverged);
  EXPECT_LT(report.after.objective, 0.99 * report.before.objective);
  EXPECT_FALSE(report.message.empty());
}

TEST(DesignOptimizer, StopsOnRequestAndKeepsTheBest) {
  ReachableDesign known;
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
    ReachableDesign known;
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
    EXPECT_NE(report.status, DesignStatus::kInfeasible) << report.message;
    known.criteria.distance_weight = weight;
    known.criteria.energy_scale = design.criteria().energy_scale;
    LinkageDesign anew = known.design();
    const DesignReport whole = optimize_design(anew, known.options);
    EXPECT_LT(report.after.objective, 1.1 * whole.after.objective) << weight << report.message;
  }
}

TEST(DesignOptimizer, CriteriaThatChangeAtTheEndAreGoneOnTo) {
  ReachableDesign known;
  DesignOptimizerOptions& options = known.options;
  options.longest = 1.02;
  int ends = 0, first = 0;
  const auto change_once = [&](const DesignReport& report, LinkageDesign& ended) {
    if (++ends > 1) return;
    EXPECT_NE(report.status, DesignStatus::kIterationLimit);
    first = report.iterations;
    DesignCriteria criteria = ended.criteria();
    for (JointTarget& target : criteria.targets) target.position.z() += 20;
    ended.set_criteria(criteria);
  };
  LinkageDesign design = known.design();
  const Eigen::VectorXd start = design.parameters();
  const DesignReport report = optimize_design(design, options, {}, {}, change_once);
  EXPECT_EQ(ends, 2);
  EXPECT_GT(report.iterations, first);
  EXPECT_EQ(design.values(design.point()).objective, report.after.objective);
  // Bounds are those of the start, not of where it was changed.
  EXPECT_LE(design.parameters().cwiseQuotient(start).maxCoeff(), 1.02 + 1e-12);

  LinkageDesign ended = known.design();
  (void)optimize_design(ended, options);
  ended.set_criteria(design.criteria());
  EXPECT_LT(report.after.objective, ended.values(ended.point()).objective);

  options.max_iterations = 1;
  ends = 1;
  LinkageDesign limited = known.design();
  EXPECT_EQ(optimize_design(limited, options, {}, {}, change_once).status,
            DesignStatus::kIterationLimit);
  EXPECT_EQ(ends, 2);
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
