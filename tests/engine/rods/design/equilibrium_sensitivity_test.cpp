#include "engine/rods/design/equilibrium_sensitivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/rods/design/shape_functions.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/equilibrium/holding.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

/// A sphere, whose closest points and their derivatives are known everywhere.
class Sphere final : public TargetSurface {
 public:
  [[nodiscard]] ClosestPoint closest(const Eigen::Vector3d& point) const override {
    const Eigen::Vector3d out = point - centre_;
    const double distance = out.norm();
    const Eigen::Vector3d n = out / distance;
    return {centre_ + radius_ * n,
            radius_ / distance * (Eigen::Matrix3d::Identity() - n * n.transpose())};
  }

 private:
  Eigen::Vector3d centre_{60, 40, -150};
  double radius_ = 180;
};

enum class Kind { kEnergy, kFlatness, kSmallestAngle, kTargets, kSurface, kSum };
enum class Shape { kFree, kOpened, kAnglesSet };
enum class Varied { kSegments, kEdges, kSections, kSegmentsAndSections, kEdgesAndSections };

DesignVariables variables_of(Varied varied) {
  using L = LengthVariables;
  using S = SectionVariables;
  switch (varied) {
    case Varied::kSegments:
      break;
    case Varied::kEdges:
      return {L::kEdges, S::kKept};
    case Varied::kSections:
      return {L::kKept, S::kSegments};
    case Varied::kSegmentsAndSections:
      return {L::kSegments, S::kSegments};
    case Varied::kEdgesAndSections:
      return {L::kEdges, S::kSegments};
  }
  return {};
}

/// One function of one equilibrium, which is found again for changed variables.
class SensitivityTest : public ::testing::TestWithParam<std::tuple<Kind, Shape, Varied>> {
 protected:
  SensitivityTest()
      : model_(testing::curved_model()), equilibrium_(model_), state_(model_), energy_(model_) {
    start_ = map_.values(model_);
    conditions_.pins = {{5}};
    EXPECT_TRUE(equilibrium_.solve(state_, conditions_, tight()).converged());
    if (std::get<1>(GetParam()) == Shape::kOpened)
      conditions_.mean_opening_angle = state_.mean_opening_angle() + 0.4;
    if (std::get<1>(GetParam()) == Shape::kAnglesSet) {
      conditions_.angles = {{0, state_.joints()[0].opening_angle + 0.2},
                            {12, state_.joints()[12].opening_angle - 0.1}};
    }
    DeploymentOptions options;
    options.last = tight();
    EXPECT_EQ(deploy(equilibrium_, state_, conditions_, options).status,
              DeploymentStatus::kReached);
  }
  [[nodiscard]] static EquilibriumOptions tight() { return {.tolerance = 1e-12}; }

  [[nodiscard]] ShapeFunction& function() {
    switch (std::get<0>(GetParam())) {
      case Kind::kEnergy:
        return energy_;
      case Kind::kFlatness:
        return flatness_;
      case Kind::kSmallestAngle:
        return angle_;
      case Kind::kTargets:
        return targets_;
      case Kind::kSurface:
        return surface_distance_;
      case Kind::kSum:
        break;
    }
    return sum_;
  }

  [[nodiscard]] Eigen::VectorXd direction(unsigned seed) const {
    Random random(seed);
    Eigen::VectorXd v(start_.size());
    for (double& value : v) value = random.normal();
    return v / v.norm();
  }
  /// The equilibrium with other variables, found from the present one.
  [[nodiscard]] LinkageState again(const Eigen::VectorXd& change) {
    DesignPoint point{model_.segment_lengths(), state_, state_};
    map_.place(model_, start_ + change, point);
    set_sizes(model_, point);
    LinkageState state = state_;
    EXPECT_TRUE(equilibrium_.solve(state, conditions_, tight()).converged());
    return state;
  }

  LinkageModel model_;
  LinkageEquilibrium equilibrium_;
  LinkageState state_;
  Conditions conditions_;
  DesignVariables variables_ = variables_of(std::get<2>(GetParam()));
  DesignVariableMap map_{model_, variables_};
  Eigen::VectorXd start_;
  Sphere sphere_;
  ElasticEnergy energy_;
  Flatness flatness_{model_, Plane{Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.1, 0.2, 1)}};
  SmallestAngle angle_{model_, 30};
  TargetDistance targets_{model_, {{0, {10, -5, 20}, 0.5}, {15, {130, 100, -10}, 2}}, nullptr, 0};
  TargetDistance surface_distance_{model_, {{3, {0, 0, 0}, 0.1}}, &sphere_, 0.7};
  SumOfFunctions sum_{{{0.3, energy_}, {0.02, flatness_}, {2, angle_}, {0.01, targets_}}};
};

TEST_P(SensitivityTest, GradientAgreesWithDifferencesOfEquilibriaSolvedAgain) {
  const EquilibriumSensitivity sensitivity(model_, state_, conditions_, variables_);
  ASSERT_TRUE(sensitivity.is_minimum());
  const Eigen::VectorXd gradient = sensitivity.adjoint(function()).gradient;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Eigen::VectorXd v = direction(seed);
    const auto value = [&](double h) { return function().value(again(h * v)); };
    // Fourth order; what bends soon wants short steps, what is soft and settles to few digits long
    // ones.
    double mismatch = std::numeric_limits<double>::infinity();
    for (const double step : {2e-3, 4e-3, 8e-3}) {
      const double difference =
          (8 * (value(step) - value(-step)) - (value(2 * step) - value(-2 * step))) / (12 * step);
      mismatch = std::min(mismatch, std::abs(gradient.dot(v) - difference));
    }
    EXPECT_LT(mismatch, 1e-6 * gradient.norm()) << seed;
  }
}

TEST_P(SensitivityTest, ProductAgreesWithDifferencesOfGradients) {
  const EquilibriumSensitivity sensitivity(model_, state_, conditions_, variables_);
  const EquilibriumSensitivity::Adjoint adjoint = sensitivity.adjoint(function());
  const Eigen::VectorXd v = direction(9);
  const Eigen::VectorXd product =
      sensitivity.product(function(), adjoint, v, sensitivity.shape_change(v));
  const auto gradient = [&](double h) -> Eigen::VectorXd {
    const LinkageState state = again(h * v);
    return EquilibriumSensitivity(model_, state, conditions_, variables_)
        .adjoint(function())
        .gradient;
  };
  constexpr double kStep = 1e-3;
  const Eigen::VectorXd difference = (gradient(kStep) - gradient(-kStep)) / (2 * kStep);
  EXPECT_LT((product - difference).norm(), 1e-4 * product.norm());
}

TEST_P(SensitivityTest, ProductsAreSymmetric) {
  const EquilibriumSensitivity sensitivity(model_, state_, conditions_, variables_);
  const EquilibriumSensitivity::Adjoint adjoint = sensitivity.adjoint(function());
  const Eigen::VectorXd u = direction(4), v = direction(5);
  const auto product = [&](const Eigen::VectorXd& along) {
    return sensitivity.product(function(), adjoint, along, sensitivity.shape_change(along));
  };
  const Eigen::VectorXd by_u = product(u), by_v = product(v);
  EXPECT_NEAR(v.dot(by_u), u.dot(by_v), 1e-7 * (by_u.norm() + by_v.norm()));
}

/// Pins, angles that are set and lengths on their bound do no work.
TEST_P(SensitivityTest, EnergiesNeedNoSolve) {
  const EquilibriumSensitivity sensitivity(model_, state_, conditions_, variables_);
  const EquilibriumSensitivity::Adjoint solved = sensitivity.adjoint(energy_);
  const EquilibriumSensitivity::Adjoint direct = sensitivity.elastic_adjoint();
  EXPECT_EQ(direct.multiplier.size(), 0);
  EXPECT_LT((direct.gradient - solved.gradient).norm(), 1e-9 * solved.gradient.norm());
  const Eigen::VectorXd v = direction(7);
  const Eigen::VectorXd change = sensitivity.shape_change(v);
  const Eigen::VectorXd expected = sensitivity.product(energy_, solved, v, change);
  EXPECT_LT((sensitivity.product(energy_, direct, v, change) - expected).norm(),
            1e-8 * expected.norm());
}

/// The solver's factor is of the very Hessian that derivatives need.
TEST_P(SensitivityTest, WithTheSolversFactorIsAsWithANewOne) {
  const EquilibriumSensitivity made(model_, state_, conditions_, variables_);
  LinkageState state = state_;
  ASSERT_TRUE(equilibrium_.solve(state, conditions_, tight()).converged());
  ASSERT_EQ(testing::joint_distance(state, state_), 0) << "it was one already";
  std::unique_ptr<HessianFactor> factor = equilibrium_.take_factor();
  ASSERT_NE(factor, nullptr);
  const EquilibriumSensitivity kept(model_, state_, conditions_, variables_, std::move(factor));
  EXPECT_TRUE(kept.is_minimum());
  const Eigen::VectorXd v = direction(6);
  const auto expect_near = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    EXPECT_LT((a - b).norm(), 1e-10 * b.norm());
  };
  expect_near(kept.shape_change(v), made.shape_change(v));
  const EquilibriumSensitivity::Adjoint adjoint = kept.adjoint(function());
  expect_near(adjoint.gradient, made.adjoint(function()).gradient);
  expect_near(kept.product(function(), adjoint, v, kept.shape_change(v)),
              made.product(function(), made.adjoint(function()), v, made.shape_change(v)));
}

INSTANTIATE_TEST_SUITE_P(
    Functions, SensitivityTest,
    ::testing::Combine(::testing::Values(Kind::kEnergy, Kind::kFlatness, Kind::kSmallestAngle,
                                         Kind::kTargets, Kind::kSurface, Kind::kSum),
                       ::testing::Values(Shape::kFree, Shape::kOpened, Shape::kAnglesSet),
                       ::testing::Values(Varied::kSegments)));

INSTANTIATE_TEST_SUITE_P(Variables, SensitivityTest,
                         ::testing::Combine(::testing::Values(Kind::kEnergy, Kind::kSum),
                                            ::testing::Values(Shape::kFree, Shape::kOpened),
                                            ::testing::Values(Varied::kEdges, Varied::kSections,
                                                              Varied::kSegmentsAndSections,
                                                              Varied::kEdgesAndSections)));

/// A joint's edge that is as short as it may be stays so, whoever has made the factor.
TEST(EquilibriumSensitivity, LengthsOnTheirBoundStayWithAnyFactor) {
  const LinkageModel model = testing::curved_model();
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.pins = {{5}};
  conditions.shortest_joint_edge = 0.99999;
  LinkageState state(model);
  ASSERT_TRUE(equilibrium.solve(state, conditions, {.tolerance = 1e-12}).converged());
  conditions.mean_opening_angle = state.mean_opening_angle() + 0.3;
  EXPECT_EQ(deploy(equilibrium, state, conditions).status, DeploymentStatus::kReached);
  ASSERT_TRUE(equilibrium.solve(state, conditions, {.tolerance = 1e-12}).converged());
  std::unique_ptr<HessianFactor> factor = equilibrium.take_factor();
  ASSERT_NE(factor, nullptr);
  ASSERT_FALSE(
      detail::lengths_on_their_bound(model, state, factor->gradient, conditions.shortest_joint_edge)
          .empty());
  const EquilibriumSensitivity made(model, state, conditions);
  const EquilibriumSensitivity kept(model, state, conditions, {}, std::move(factor));
  Random random(31);
  Eigen::VectorXd v(model.segment_lengths().size());
  for (double& value : v) value = random.normal();
  const Eigen::VectorXd change = kept.shape_change(v);
  EXPECT_LT((made.shape_change(v) - change).norm(), 1e-8 * change.norm());
  ElasticEnergy energy(model);
  const Eigen::VectorXd gradient = kept.adjoint(energy).gradient;
  EXPECT_LT((made.adjoint(energy).gradient - gradient).norm(), 1e-8 * gradient.norm());
  EXPECT_LT((made.elastic_adjoint().gradient - gradient).norm(), 1e-8 * gradient.norm());
}

TEST(EquilibriumSensitivity, TheShapeChangesAsItSays) {
  LinkageModel model = testing::curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{5}};
  ASSERT_TRUE(equilibrium.solve(state, conditions, {.tolerance = 1e-12}).converged());
  const EquilibriumSensitivity sensitivity(model, state, conditions);
  const Eigen::VectorXd lengths = model.segment_lengths();
  Random random(2);
  Eigen::VectorXd v(lengths.size());
  for (double& value : v) value = random.normal();
  const Eigen::VectorXd change = sensitivity.shape_change(v);
  constexpr double kStep = 1e-3;
  std::vector<Eigen::Vector3d> moved[2];
  for (const int side : {0, 1}) {
    model.set_segment_lengths(lengths + (side == 0 ? kStep : -kStep) * v);
    LinkageState beside = state;
    ASSERT_TRUE(equilibrium.solve(beside, conditions, {.tolerance = 1e-12}).converged());
    for (const auto& joint : beside.joints()) moved[side].push_back(joint.position);
  }
  for (int j = 0; j < model.variables().joints(); ++j) {
    const Eigen::Vector3d difference =
        (moved[0][static_cast<std::size_t>(j)] - moved[1][static_cast<std::size_t>(j)]) /
        (2 * kStep);
    EXPECT_LT((change.segment<3>(model.variables().joint_begin(j)) - difference).norm(),
              1e-5 * change.norm())
        << j;
  }
}

TEST(EquilibriumSensitivity, RefusesWhatItCannotDifferentiate) {
  const LinkageModel model = testing::curved_model();
  const LinkageState state(model);
  Conditions conditions;
  conditions.loads = {{0, Eigen::Vector3d(0, 0, 1), Eigen::Vector3d::Zero(), 0}};
  try {
    EquilibriumSensitivity(model, state, conditions);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "loads");
  }
}

/// A plane that counts how often it is asked.
class CountingPlane final : public TargetSurface {
 public:
  [[nodiscard]] ClosestPoint closest(const Eigen::Vector3d& point) const override {
    ++calls;
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    return {{point.x(), point.y(), 1}, Eigen::Matrix3d::Identity() - z * z.transpose()};
  }
  mutable int calls = 0;
};

TEST(ShapeFunctions, ClosestPointsAreSoughtOncePerShape) {
  const LinkageModel model = testing::curved_model();
  const LinkageState state(model);
  const CountingPlane plane;
  TargetDistance distance(model, {}, &plane, 1);
  const int joints = model.variables().joints();
  const double value = distance.value(state);
  Eigen::VectorXd v = Eigen::VectorXd::Ones(model.variables().size()), by = 0 * v;
  distance.add_gradient(state, 1, by);
  distance.add_second(state, v, 1, by);
  distance.add_second(state, v, 1, by);
  EXPECT_EQ(plane.calls, joints);
  Eigen::VectorXd step = 0 * v;
  step[model.variables().joint_begin(3) + kJointPosition + 2] = 0.5;
  const LinkageState moved = state.moved(model, step);
  EXPECT_NE(distance.value(moved), value);
  EXPECT_EQ(plane.calls, 2 * joints);
  EXPECT_EQ(distance.value(state), value);
}

TEST(ShapeFunctions, BadInputIsNamed) {
  const LinkageModel model = testing::curved_model();
  const auto field = [](const auto& make) -> std::string {
    try {
      make();
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  EXPECT_EQ(field([&] {
              Flatness(model, Plane{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
            }),
            "plane.normal");
  EXPECT_EQ(field([&] { SmallestAngle(model, 0); }), "angle_sharpness");
  EXPECT_EQ(field([&] {
              TargetDistance(model, {{16, Eigen::Vector3d::Zero(), 1}}, nullptr, 0);
            }),
            "targets[0].joint");
  EXPECT_EQ(field([&] {
              TargetDistance(model, {{1, Eigen::Vector3d::Zero(), -1}}, nullptr, 0);
            }),
            "targets[0].weight");
  EXPECT_EQ(field([&] { TargetDistance(model, {}, nullptr, -1); }), "surface_weight");
}

TEST(ShapeFunctions, TheSmoothAngleIsBelowTheSmallestByLittle) {
  const LinkageModel model = testing::curved_model();
  const LinkageState state(model);
  double least = 4;
  for (const auto& joint : state.joints()) least = std::min(least, joint.opening_angle);
  for (const double sharpness : {10.0, 100.0, 1e4, 1e7}) {
    const double value = SmallestAngle(model, sharpness).value(state);
    EXPECT_LE(value, least);
    EXPECT_GE(value, least - std::log(16.0) / sharpness);
  }
}

}  // namespace
}  // namespace limber::rods
