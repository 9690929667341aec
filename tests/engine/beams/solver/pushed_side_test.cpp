#include <gtest/gtest.h>

#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

/// A hinged rod whose ends come together, pushed at one of its nodes by a force so small beside
/// what it buckles at that nothing but its direction counts.
BeamModel pushed_rod(int elements, int node, double force) {
  BeamModel model =
      limber::testing::compressed_model(elements, limber::testing::BeamEnds::kHinged, 0.9);
  model.temporary_loads = {{node, {0, 0, force}}};
  return model;
}

constexpr double kBuckles = 9.8696;  // pi^2 EI / L^2, [force]

TEST(BeamPushedSide, OneNodeIsEnough) {
  for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kNewton}) {
    BeamSolveOptions options;
    options.method = method;
    for (const int elements : {12, 20, 40}) {
      for (const int node : {1, elements / 4, elements / 2, elements - 2}) {
        for (const double side : {1.0, -1.0}) {
          const BeamSolution found = find_equilibrium(
              BeamStructure(pushed_rod(elements, node, side * kBuckles / 132)), options);
          EXPECT_TRUE(found.report.converged())
              << elements << " elements, pushed at node " << node << ", " << to_string(method)
              << ": " << found.report.message;
          EXPECT_GT(side * found.state.positions(2, elements / 2), 0.15)
              << elements << " elements, pushed at node " << node << ", " << to_string(method);
          EXPECT_EQ(found.report.load_factor, 1);
          EXPECT_TRUE(found.report.snaps.empty()) << "they were not requested";
        }
      }
    }
  }
}

/// Whoever asks for the branch gets it, pushed or not: a relaxation knows none.
TEST(BeamPushedSide, ABranchIsFollowedFromAPush) {
  BeamModel model = pushed_rod(20, 10, kBuckles / 132);
  const BeamSolution followed =
      find_equilibrium(BeamStructure(model), BeamSolveOptions::following());
  ASSERT_TRUE(followed.report.converged()) << followed.report.message;
  EXPECT_EQ(followed.report.method, BeamMethod::kNewton);
  EXPECT_EQ(followed.report.relaxation_steps, 0);
  EXPECT_GT(followed.state.positions(2, 10), 0.13);
  EXPECT_GT(find_equilibrium(BeamStructure(model)).report.relaxation_steps, 0);
}

/// What a push does where the whole structure is moved says nothing of its side.
TEST(BeamPushedSide, OfAStructureThatIsMovedAsAWhole) {
  for (const double lift : {0.5, -0.5}) {
    for (const int node : {1, 5, 10, 17}) {
      for (const double side : {1.0, -1.0}) {
        BeamModel model = pushed_rod(20, node, side * kBuckles / 132);
        for (const int end : {0, 20}) {
          for (BeamSupport& support : model.supports)
            if (support.node == end) support.fixed[0] = support.fixed[2] = false;
          std::erase_if(model.motions, [end](const auto& motion) { return motion.node == end; });
          PrescribedMotion motion;
          motion.node = end;
          motion.translates = {true, false, true};
          motion.translation = {end == 0 ? 0.0 : -0.1, 0, lift};
          model.motions.push_back(motion);
        }
        const BeamSolution found = find_equilibrium(BeamStructure(model));
        ASSERT_TRUE(found.report.converged()) << found.report.message;
        EXPECT_GT(side * (found.state.positions(2, 10) - lift), 0.13)
            << "lifted by " << lift << ", pushed at node " << node << ": " << found.report.message;
      }
    }
  }
}

/// Where what is there for good is stronger, a push changes the path only.
TEST(BeamPushedSide, LoadsThatStayAreStronger) {
  BeamModel model = limber::testing::cantilever_model(10, 1);
  model.temporary_loads = {{10, {0, 0, -0.5}}};
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_NEAR(found.state.positions(2, 10), .30172, 1e-4);
  EXPECT_NE(found.report.message.find("the other side"), std::string::npos) << found.report.message;
}

}  // namespace
}  // namespace limber::beams
