#include <gtest/gtest.h>

#include <string>

#include "engine/beams/solver/following_tangent.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

/// A cantilever whose tip load alpha = P L^2 / EI turns with the tip.
BeamModel follower(int elements, double alpha, bool in_plane) {
  BeamModel model = limber::testing::straight_beam(elements);
  model.supports.push_back(limber::testing::clamped(0));
  for (int i = 1; in_plane && i <= elements; ++i)
    model.supports.push_back({i, {false, true, false, true, false, true}});
  NodalLoad load;
  load.node = elements;
  load.force = {0, 0, alpha};
  load.direction = LoadDirection::kFollowing;
  model.loads.push_back(load);
  return model;
}

/// Tips by an independent integration of the elastica.
TEST(BeamFollowingLoads, OnACantileverHaveTheKnownShape) {
  for (const bool in_plane : {true, false}) {
    for (const BeamMethod method :
         {BeamMethod::kChoose, BeamMethod::kRelaxation, BeamMethod::kRelaxationThenNewton}) {
      BeamSolveOptions options;
      options.method = method;
      const BeamSolution found =
          find_equilibrium(BeamStructure(follower(20, 10, in_plane)), options);
      ASSERT_TRUE(found.report.converged()) << to_string(method) << ": " << found.report.message;
      EXPECT_NEAR(found.state.positions(0, 20), -0.0921, 3e-4) << to_string(method);
      EXPECT_NEAR(found.state.positions(2, 20), 0.5470, 3e-4) << to_string(method);
      EXPECT_NE(found.report.message.find("not judged"), std::string::npos) << found.report.message;
    }
  }
}

TEST(BeamFollowingLoads, WhereLoadStepsFailTheMessageSuggestsARelaxation) {
  BeamSolveOptions options;
  options.method = BeamMethod::kNewton;
  const BeamSolution found = find_equilibrium(BeamStructure(follower(20, 10, true)), options);
  EXPECT_FALSE(found.report.converged());
  EXPECT_NE(found.report.message.find("relaxation"), std::string::npos) << found.report.message;
}

/// Equally stiff in both planes, it diverges in two directions at once: the determinant is
/// positive.
TEST(BeamFollowingLoads, AColumnEquallyStiffInBothPlanesDivergesInBoth) {
  BeamModel model = limber::testing::straight_beam(8);
  model.sections[0].bending_3 = model.sections[0].bending_2;
  model.supports = {{0, {true, true, true, true, false, false}},
                    {8, {false, true, true, false, false, false}}};
  NodalLoad load;
  load.node = 8;
  load.direction = LoadDirection::kFollowing;
  for (const double euler : {0.9, 3.0}) {
    load.force = {-euler * 9.8696, 0, 0};
    model.loads = {load};
    for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation,
                                    BeamMethod::kRelaxationThenNewton, BeamMethod::kChoose}) {
      BeamSolveOptions options;
      options.method = method;
      const BeamSolution found = find_equilibrium(BeamStructure(model), options);
      const std::string text = std::string(to_string(method)) + ": " + found.report.message;
      EXPECT_EQ(found.report.message.find("minimum"), std::string::npos) << text;
      const double aside = found.state.positions.bottomRows(2).cwiseAbs().maxCoeff();
      if (euler < 1) {
        EXPECT_TRUE(found.report.converged()) << text;
        EXPECT_EQ(found.report.negative_eigenvalues, 0) << text;
        EXPECT_NE(found.report.message.find("no direction diverges"), std::string::npos) << text;
      } else if (aside < 1e-6) {
        EXPECT_FALSE(found.report.converged()) << text;
      }
      if (euler > 1 && method == BeamMethod::kRelaxation) {
        EXPECT_LT(aside, 1e-6);
        EXPECT_EQ(found.report.status, BeamStatus::kUnstable) << text;
        EXPECT_EQ(found.report.negative_eigenvalues, 2) << text;
      }
    }
  }
}

/// Pressed along itself by a load that keeps to its axis, a column never diverges; by one that
/// keeps its direction in space it does.
TEST(BeamFollowingLoads, StabilityIsDivergence) {
  for (const bool follows : {true, false}) {
    BeamModel model = follower(12, 0, true);
    model.loads[0].force = {-1.5 * 2.4674, 0, 0};
    model.loads[0].direction = follows ? LoadDirection::kFollowing : LoadDirection::kFixed;
    BeamSolveOptions options;
    options.method = BeamMethod::kRelaxation;
    const BeamSolution found = find_equilibrium(BeamStructure(model), options);
    EXPECT_EQ(found.report.converged(), follows) << found.report.message;
    EXPECT_NEAR(found.state.positions(2, 12), 0, 1e-9);
  }
}

/// Moments of fixed direction have a potential where their node turns about one axis only.
TEST(BeamFollowingLoads, MomentsOfFixedDirectionAreReportedToHaveNoPotential) {
  for (const bool in_plane : {true, false}) {
    BeamModel model = follower(10, 0, in_plane);
    model.sections[0].bending_3 = 2;
    model.loads = {{10, Eigen::Vector3d::Zero(), {0, -0.9, 0}, LoadDirection::kFixed}};
    for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kChoose,
                                    BeamMethod::kRelaxation, BeamMethod::kRelaxationThenNewton}) {
      BeamSolveOptions options;
      options.method = method;
      const BeamSolution found = find_equilibrium(BeamStructure(model), options);
      const std::string text = std::string(to_string(method)) + ": " + found.report.message;
      ASSERT_TRUE(found.report.converged()) << text;
      EXPECT_EQ(found.report.negative_eigenvalues, 0) << text;
      const auto says = [&](const char* what) {
        return found.report.message.find(what) != std::string::npos;
      };
      EXPECT_EQ(says("no direction diverges"), !in_plane) << text;
      EXPECT_EQ(says("moments of fixed direction on nodes that turn about several axes have no "
                     "potential"),
                !in_plane)
          << text;
      if (!in_plane) {
        EXPECT_FALSE(says("minimum")) << text;
      }
    }
  }
}

/// Along every free unknown, with forces and moments that follow and such that do not, on nodes and
/// over elements.
TEST(BeamFollowingLoads, TangentIsTheDerivativeOfWhatIsOutOfBalance) {
  BeamModel model = follower(3, 0, false);
  model.loads = {{3, {0.3, -0.2, 0.5}, {0.2, 0.1, -0.4}, LoadDirection::kFollowing},
                 {2, {0.1, 0.2, 0.3}, {-0.3, 0.2, 0.1}, LoadDirection::kFixed}};
  model.distributed_loads = {{1, {0.2, -0.3, 0.4}, LoadDirection::kFollowing},
                             {2, {0.1, 0.3, -0.2}, LoadDirection::kFollowing},
                             {0, {-0.2, 0.4, 0.3}}};
  model.sections[0].stretching = 100;  // differences of forces keep their digits
  model.supports.push_back({1, {false, true, false, false, false, false}});
  const BeamStructure structure(model);
  const NodeLoads loads = NodeLoads::of(model);
  const BeamState state = find_equilibrium(structure).state;
  const auto residual = [&](const BeamState& at) -> Eigen::VectorXd {
    return elastic_gradient(structure, at) - load_vector(structure, loads, at);
  };
  detail::FollowingTangent tangent(structure);
  ASSERT_TRUE(tangent.factor(state, loads));
  const Stiffness& by = tangent.stiffness();
  for (int i = 0; i < by.size(); ++i) {
    const Eigen::VectorXd increments = 1e-5 * by.extended(Eigen::VectorXd::Unit(by.size(), i));
    const Eigen::VectorXd change = residual(structure.moved(state, increments)) -
                                   residual(structure.moved(state, -increments));
    const Eigen::VectorXd found = tangent.solve(by.restricted(change) / 2e-5);
    EXPECT_LT((found - Eigen::VectorXd::Unit(by.size(), i)).norm(), 1e-5) << i;
  }
}

}  // namespace
}  // namespace limber::beams
