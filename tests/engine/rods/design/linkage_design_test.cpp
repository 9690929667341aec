#include "engine/rods/design/linkage_design.h"

#include <gtest/gtest.h>

#include <limits>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "tests/engine/rods/design/small_designs.h"

namespace limber::rods {
namespace {

using testing::curved_design;
using testing::random_direction;
using testing::SmallDesign;

TEST(LinkageDesign, GradientsAndProductsAgreeWithDifferencesOfTrials) {
  SmallDesign problem = curved_design();
  problem.criteria.least_area = 0.1;  // else its derivatives are not taken
  LinkageDesign design = problem.design();
  const Eigen::VectorXd lengths = design.point().lengths;
  const Eigen::VectorXd v = random_direction(lengths.size(), 3);
  const DesignMeasures<Eigen::VectorXd> gradients = design.gradients();
  const DesignMeasures<Eigen::VectorXd> products = design.products(v);
  const auto at = [&](double h) {
    DesignTrial trial = design.trial(lengths + h * v);
    EXPECT_EQ(trial.status, TrialStatus::kFound) << trial.message;
    return trial.point;
  };
  constexpr double kStep = 2e-3;
  const DesignValues near[] = {design.values(at(kStep)), design.values(at(-kStep))};
  const DesignValues far[] = {design.values(at(2 * kStep)), design.values(at(-2 * kStep))};
  const auto slope = [&](double DesignMeasures<double>::*measure) {
    return (8 * (near[0].*measure - near[1].*measure) - (far[0].*measure - far[1].*measure)) /
           (12 * kStep);
  };
  using Values = DesignMeasures<double>;
  EXPECT_NEAR(gradients.objective.dot(v), slope(&Values::objective),
              1e-6 * gradients.objective.norm());
  EXPECT_NEAR(gradients.flatness.dot(v), slope(&Values::flatness),
              1e-6 * gradients.flatness.norm());
  EXPECT_NEAR(gradients.smallest_angle.dot(v), slope(&Values::smallest_angle),
              1e-6 * gradients.smallest_angle.norm());
  EXPECT_NEAR(gradients.deployed_area.dot(v), slope(&Values::deployed_area),
              1e-6 * gradients.deployed_area.norm());
  const DesignPoint forward = at(1e-3), backward = at(-1e-3);
  design.move_to(forward);
  const DesignMeasures<Eigen::VectorXd> after = design.gradients();
  design.move_to(backward);
  const DesignMeasures<Eigen::VectorXd> before = design.gradients();
  const auto check = [&](Eigen::VectorXd DesignMeasures<Eigen::VectorXd>::*measure) {
    const Eigen::VectorXd difference = (after.*measure - before.*measure) / 2e-3;
    EXPECT_LT((products.*measure - difference).norm(), 1e-4 * (products.*measure).norm());
  };
  check(&DesignMeasures<Eigen::VectorXd>::objective);
  check(&DesignMeasures<Eigen::VectorXd>::flatness);
  check(&DesignMeasures<Eigen::VectorXd>::smallest_angle);
  check(&DesignMeasures<Eigen::VectorXd>::deployed_area);
}

TEST(LinkageDesign, AreasThatNothingBoundsAreMeasuredWithoutDerivatives) {
  SmallDesign problem = curved_design();
  LinkageDesign free = problem.design();
  problem.criteria.least_area = 0.1;
  LinkageDesign bound = problem.design();
  const Eigen::VectorXd v = random_direction(free.parameters().size(), 3);
  const DesignMeasures<Eigen::VectorXd> gradients = free.gradients(), products = free.products(v);
  EXPECT_EQ(gradients.deployed_area, Eigen::VectorXd::Zero(v.size()));
  EXPECT_EQ(products.deployed_area, Eigen::VectorXd::Zero(v.size()));
  EXPECT_EQ(gradients.objective, bound.gradients().objective);
  EXPECT_EQ(free.values(free.point()).deployed_area, bound.values(bound.point()).deployed_area);
  EXPECT_GT(bound.gradients().deployed_area.norm(), 0);
  DesignCriteria bounded = free.criteria();
  bounded.least_area = 0.1;
  free.set_criteria(bounded);
  EXPECT_EQ(free.gradients().deployed_area, bound.gradients().deployed_area);
}

/// Trials leave the factors that certified their equilibria; points that are no trial's do not.
TEST(LinkageDesign, DerivativesWithATrialsFactorsAreThoseWithNewOnes) {
  const SmallDesign problem = curved_design();
  LinkageDesign kept = problem.design(), made = problem.design();
  const Eigen::VectorXd lengths = kept.parameters();
  const Eigen::VectorXd v = random_direction(lengths.size(), 12);
  const auto expect_near = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    EXPECT_LT((a - b).norm(), 1e-10 * b.norm());
  };
  for (int step = 1; step <= 3; ++step) {
    const DesignTrial trial = kept.trial(lengths + 0.1 * step * v);
    ASSERT_EQ(trial.status, TrialStatus::kFound) << trial.message;
    kept.move_to(trial.point);
    made.move_to(trial.point);
    const DesignMeasures<Eigen::VectorXd> a = kept.gradients(), b = made.gradients();
    expect_near(a.objective, b.objective);
    expect_near(a.flatness, b.flatness);
    expect_near(a.smallest_angle, b.smallest_angle);
    expect_near(kept.products(v).objective, made.products(v).objective);
    EXPECT_EQ(kept.factored_anew(), 0);
    EXPECT_EQ(made.factored_anew(), 2 * step);
  }
  // Not the last trial's: the factors of that may not be taken for it.
  const DesignPoint last = kept.point();
  ASSERT_EQ(kept.trial(lengths).status, TrialStatus::kFound);
  kept.move_to(problem.design().point());
  made.move_to(problem.design().point());
  expect_near(kept.gradients().objective, made.gradients().objective);
  kept.move_to(last);
  made.move_to(last);
  expect_near(kept.gradients().objective, made.gradients().objective);
}

/// The flat shape's factors were made, the deployed shape's were not: neither may be taken for
/// those of the point.
TEST(LinkageDesign, DerivativesAreRightAfterATrialLostInTheDeployedShapeOnly) {
  const SmallDesign problem = curved_design();
  // Exchanged: what is nearly flat, and soft, is the second shape.
  LinkageDesign design(problem.model, problem.deployed, problem.flat,
                       {problem.start->lengths, problem.start->deployed, problem.start->flat},
                       problem.criteria, problem.limits);
  const DesignMeasures<Eigen::VectorXd> gradients = design.gradients();
  const Eigen::VectorXd lengths = design.parameters();
  const Eigen::VectorXd v = random_direction(lengths.size(), 21);
  const Eigen::VectorXd product = design.products(v).objective;
  int lost = 0;
  for (unsigned seed = 1; seed <= 40 && lost < 3; ++seed) {
    const Eigen::VectorXd direction = random_direction(lengths.size(), seed);
    for (double size = 1; size < 30 && lost < 3; size *= 1.5) {
      const DesignTrial trial = design.trial(lengths + size * direction);
      if (trial.lost == LostShape::kFlat) break;
      if (trial.lost != LostShape::kDeployed) continue;
      ++lost;
      design.move_to(design.point());  // derivatives are asked for anew
      EXPECT_LT((design.gradients().objective - gradients.objective).norm(),
                1e-9 * gradients.objective.norm());
      EXPECT_LT((design.gradients().flatness - gradients.flatness).norm(),
                1e-9 * gradients.flatness.norm());
      EXPECT_LT((design.products(v).objective - product).norm(), 1e-8 * product.norm());
    }
  }
  EXPECT_GE(lost, 1);
}

TEST(LinkageDesign, DerivativesDoNotDependOnTheNumberOfThreads) {
  const SmallDesign problem = curved_design();
  const int before = thread_count();
  std::vector<DesignMeasures<Eigen::VectorXd>> found;
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    LinkageDesign design = problem.design();
    const DesignTrial trial =
        design.trial(design.parameters() + 0.2 * random_direction(design.parameters().size(), 4));
    EXPECT_EQ(trial.status, TrialStatus::kFound) << trial.message;
    design.move_to(trial.point);
    found.push_back(design.gradients());
    found.push_back(design.products(random_direction(design.parameters().size(), 5)));
  }
  set_thread_count(before);
  for (const int k : {0, 1}) {
    const DesignMeasures<Eigen::VectorXd>&one = found[k], &two = found[k + 2];
    EXPECT_EQ(one.objective, two.objective);
    EXPECT_EQ(one.flat_energy, two.flat_energy);
    EXPECT_EQ(one.flatness, two.flatness);
    EXPECT_EQ(one.smallest_angle, two.smallest_angle);
  }
}

TEST(LinkageDesign, OfTheObjectiveAloneTheSameComesOut) {
  const SmallDesign problem = curved_design();
  LinkageDesign design = problem.design();
  using Which = LinkageDesign::Which;
  const Eigen::VectorXd v = random_direction(design.parameters().size(), 13);
  const Eigen::VectorXd gradient = design.gradients(Which::kObjective).objective;
  EXPECT_EQ(design.gradients(Which::kObjective).flatness.size(), 0);
  const Eigen::VectorXd product = design.products(v, Which::kObjective).objective;
  EXPECT_EQ(design.gradients().objective, gradient);
  EXPECT_EQ(design.gradients().flatness.size(), gradient.size());
  EXPECT_EQ(design.products(v).objective, product);
}

TEST(LinkageDesign, OtherCriteriaApplyAtTheSamePoint) {
  SmallDesign problem = curved_design();
  LinkageDesign design = problem.design();
  (void)design.gradients();
  problem.criteria.distance_weight = 0.1;
  problem.criteria.energy_scale = design.criteria().energy_scale;
  design.set_criteria(problem.criteria);
  const Eigen::VectorXd expected = problem.design().gradients().objective;
  EXPECT_LT((design.gradients().objective - expected).norm(), 1e-12 * expected.norm());
}

TEST(LinkageDesign, TheObjectiveIsWhatItIsMadeOf) {
  const SmallDesign problem = curved_design();
  LinkageDesign design = problem.design();
  const DesignValues values = design.values(design.point());
  const DesignCriteria& criteria = design.criteria();
  EXPECT_DOUBLE_EQ(criteria.energy_scale, values.deployed_energy);
  EXPECT_NEAR(values.objective,
              0.9 * values.flat_energy / values.deployed_energy + 0.1 +
                  3 * values.distance / (criteria.length_scale * criteria.length_scale),
              1e-12 * values.objective);
  EXPECT_GT(values.flatness, 0);
}

TEST(LinkageDesign, ATrialThatIsNotBelievedLeavesTheDesignAsItIs) {
  const SmallDesign problem = curved_design();
  LinkageDesign design = problem.design();
  const DesignValues before = design.values(design.point());
  const Eigen::VectorXd lengths = design.point().lengths;
  for (const double factor : {0.01, 3.0, -1.0}) {
    const DesignTrial trial = design.trial(factor * lengths.array().sin().abs().matrix());
    EXPECT_NE(trial.status, TrialStatus::kFound) << factor;
    EXPECT_FALSE(trial.message.empty());
  }
  EXPECT_EQ(design.model().segment_lengths(), lengths);
  EXPECT_EQ(design.values(design.point()).objective, before.objective);
}

/// Of the curved design, with limits of its own.
DesignTrial trial_within(const DesignLimits& limits, unsigned seed, double size) {
  SmallDesign problem = curved_design();
  problem.limits = limits;
  problem.limits.equilibrium.tolerance = 1e-12;
  LinkageDesign design = problem.design();
  const Eigen::VectorXd here = design.parameters();
  return design.trial(here + size * random_direction(here.size(), seed));
}

TEST(LinkageDesign, WhatLandsFartherFromItsPredictionThanAllowedHasJumped) {
  constexpr double kSize = 1.3;
  const DesignTrial free = trial_within({}, 2, kSize);
  ASSERT_EQ(free.status, TrialStatus::kFound) << free.message;
  ASSERT_GT(free.surprise, 0.02);
  // Largest and small in units of what is judged.
  const auto judge = [&](double largest, double share, double small) {
    DesignLimits limits;
    limits.largest_surprise = largest * free.surprise;
    limits.surprise_share = share;
    limits.small_surprise = small * free.surprise;
    const DesignTrial trial = trial_within(limits, 2, kSize);
    if (trial.status == TrialStatus::kJumped) {
      EXPECT_NE(trial.message.find("degrees from its prediction"), std::string::npos)
          << trial.message;
      EXPECT_NE(trial.lost, LostShape::kNone);
    }
    return trial.status;
  };
  constexpr double kMuch = 10, kNothing = 1e-9;
  EXPECT_EQ(judge(1.01, kMuch, kMuch), TrialStatus::kFound);
  EXPECT_EQ(judge(0.99, kMuch, kMuch), TrialStatus::kJumped);
  EXPECT_EQ(judge(kMuch, kNothing, 1.01), TrialStatus::kFound);
  EXPECT_EQ(judge(kMuch, kNothing, 0.99), TrialStatus::kJumped);
  EXPECT_EQ(judge(kMuch, kMuch, 0), TrialStatus::kFound);
  EXPECT_EQ(judge(kMuch, kNothing, 0), TrialStatus::kJumped);
}

TEST(LinkageDesign, WhatWouldMoveFartherThanAllowedIsNotTried) {
  DesignLimits limits;
  limits.largest_move = 0.05;
  EXPECT_EQ(trial_within(limits, 2, 0.1).status, TrialStatus::kFound);
  const DesignTrial far = trial_within(limits, 2, 1.3);
  EXPECT_EQ(far.status, TrialStatus::kTooFar);
  EXPECT_EQ(far.iterations, 0);
  EXPECT_NE(far.message.find("too far"), std::string::npos) << far.message;
  EXPECT_EQ(trial_within({}, 2, 1.3).status, TrialStatus::kFound);
}

/// Where what bends the path is more than what leads along it.
TEST(LinkageDesign, PathsThatTurnRoundAreNotPredicted) {
  DesignLimits limits;
  limits.largest_move = limits.largest_surprise = 100;
  EXPECT_EQ(trial_within(limits, 6, 2.8).status, TrialStatus::kFound);
  const DesignTrial bent = trial_within(limits, 6, 4.3);
  EXPECT_EQ(bent.status, TrialStatus::kTooFar);
  EXPECT_EQ(bent.iterations, 0);
  EXPECT_NE(bent.message.find("turns too sharply"), std::string::npos) << bent.message;
  // Straight predictions have no bend to look at.
  limits.predictor = PredictorOrder::kFirst;
  EXPECT_GT(trial_within(limits, 6, 4.3).iterations, 0);
}

/// A surface that fails on request.
class BrittleSurface final : public TargetSurface {
 public:
  [[nodiscard]] ClosestPoint closest(const Eigen::Vector3d& point) const override {
    if (broken) throw Error(ErrorCode::kNumerical, "", "broken");
    return {Eigen::Vector3d(point.x(), point.y(), 0),
            Eigen::Vector3d(1, 1, 0).asDiagonal().toDenseMatrix()};
  }
  bool broken = false;
};

TEST(LinkageDesign, WhatThrowsHalfwayLeavesTheModelAsItWas) {
  SmallDesign problem = curved_design();
  const auto surface = std::make_shared<BrittleSurface>();
  problem.criteria.surface = surface;
  LinkageDesign design = problem.design();
  const Eigen::VectorXd lengths = design.parameters();
  const DesignTrial trial = design.trial(lengths + 0.1 * random_direction(lengths.size(), 8));
  ASSERT_EQ(trial.status, TrialStatus::kFound) << trial.message;
  surface->broken = true;
  EXPECT_THROW((void)design.values(trial.point), Error);
  EXPECT_EQ(design.model().segment_lengths(), lengths);
}

TEST(LinkageDesign, PredictionsAreOfTheOrderThatTheySay) {
  SmallDesign problem = curved_design();
  for (const PredictorOrder order : {PredictorOrder::kFirst, PredictorOrder::kSecond}) {
    problem.limits.predictor = order;
    LinkageDesign design = problem.design();
    const Eigen::VectorXd lengths = design.point().lengths;
    const Eigen::VectorXd v = random_direction(lengths.size(), 6);
    const auto surprise = [&](double h) {
      const DesignTrial trial = design.trial(lengths + h * v);
      EXPECT_EQ(trial.status, TrialStatus::kFound) << trial.message;
      return trial.surprise;
    };
    const double ratio = surprise(0.125) / surprise(0.0625);
    const double expected = order == PredictorOrder::kFirst ? 4 : 8;
    EXPECT_NEAR(ratio, expected, 0.2 * expected);
  }
}

TEST(LinkageDesign, PredictionsOfSecondOrderSaveNewtonSteps) {
  SmallDesign problem = curved_design();
  int steps[2] = {0, 0};
  for (const PredictorOrder order : {PredictorOrder::kFirst, PredictorOrder::kSecond}) {
    problem.limits.predictor = order;
    LinkageDesign design = problem.design();
    const Eigen::VectorXd lengths = design.point().lengths;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const Eigen::VectorXd v = random_direction(lengths.size(), seed);
      steps[static_cast<int>(order)] += design.trial(lengths + v).iterations;
    }
  }
  EXPECT_LT(steps[1], steps[0]);
}

TEST(LinkageDesign, NewCriteriaKeepTheScales) {
  const SmallDesign problem = curved_design();
  LinkageDesign design = problem.design();
  const double scale = design.criteria().energy_scale;
  DesignCriteria criteria = problem.criteria;
  criteria.flat_share = 0.5;
  design.set_criteria(criteria);
  EXPECT_EQ(design.criteria().energy_scale, scale);
  criteria.targets[0].weight = -1;
  EXPECT_THROW(design.set_criteria(criteria), Error);
  EXPECT_EQ(design.criteria().targets[0].weight, 0.5);
}

TEST(LinkageDesign, BadInputIsNamed) {
  const auto field = [](const auto& spoil) -> std::string {
    SmallDesign problem = curved_design();
    spoil(problem);
    try {
      (void)problem.design();
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(field([](SmallDesign& p) { p.criteria.flat_share = 1.5; }), "flat_share");
  EXPECT_EQ(field([](SmallDesign& p) { p.criteria.distance_weight = -1; }), "distance_weight");
  EXPECT_EQ(field([](SmallDesign& p) { p.criteria.surface_weight = -1; }), "surface_weight");
  EXPECT_EQ(field([](SmallDesign& p) { p.criteria.surface_weight = 1e31; }), "surface_weight");
  EXPECT_EQ(field([](SmallDesign& p) { p.criteria.targets.at(1).weight = 1e300; }),
            "targets[1].weight");
  EXPECT_EQ(field([](SmallDesign& p) {
              p.criteria.joint_surface_weights.setOnes(p.model.variables().joints());
              p.criteria.joint_surface_weights[2] = 1e300;
            }),
            "joint_surface_weights[2]");
  EXPECT_EQ(field([](SmallDesign& p) { p.flat.pins = {{99}}; }), "flat.pins[0].joint");
  EXPECT_EQ(field([](SmallDesign& p) { p.limits.equilibrium.tolerance = 2; }),
            "equilibrium.tolerance");
}

}  // namespace
}  // namespace limber::rods
