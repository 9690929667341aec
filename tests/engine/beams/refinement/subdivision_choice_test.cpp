#include "engine/beams/refinement/subdivision_choice.h"

#include <gtest/gtest.h>

#include <limits>

#include "engine/base/error.h"
#include "engine/beams/refinement/member_results.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

TEST(SubdivisionChoice, RefinesWhereTheErrorComesFrom) {
  const BeamModel model = limber::testing::straight_beam(4);
  const Subdivision whole = Subdivision::even(model, 1);
  const auto refined = refined_where_needed(model, whole, {10, 0.1, 3, 0.2}, 100);
  ASSERT_TRUE(refined);
  EXPECT_EQ(refined->parts(), (std::vector{2, 1, 2, 1}));
  EXPECT_FALSE(refined_where_needed(model, whole, {10, 0.1, 3, 0.2}, 5));
  EXPECT_FALSE(refined_where_needed(model, whole, {0, 0, 0, 0}, 100)) << "there is no error";
  const Subdivision finest = Subdivision::even(model, BeamDiscretisation::kMaxParts);
  EXPECT_FALSE(refined_where_needed(model, finest, {10, 0.1, 3, 0.2}, 1000));
}

TEST(SubdivisionChoice, CoarsensWhatTheToleranceHasRoomFor) {
  const BeamModel model = limber::testing::straight_beam(4);
  const Subdivision cut(model, {8, 8, 4, 1});
  // A hundredth of the tolerance: indicators may grow to twenty-five times their sum.
  const auto coarser = coarsened_where_possible(model, cut, {10, 0.1, 0.1, 1}, 1e-5, 1e-3);
  ASSERT_TRUE(coarser);
  EXPECT_EQ(coarser->parts(), (std::vector{4, 4, 2, 1}));
  const auto some = coarsened_where_possible(model, cut, {10, 0.1, 0.1, 1}, 1e-4, 1e-3);
  ASSERT_TRUE(some);
  EXPECT_EQ(some->parts(), (std::vector{8, 4, 2, 1}));
  EXPECT_FALSE(coarsened_where_possible(model, cut, {10, 0.1, 0.1, 1}, 3e-4, 1e-3));
  EXPECT_FALSE(coarsened_where_possible(model, Subdivision::even(model, 1), {1, 1, 1, 1}, 0, 1e-3));
}

TEST(BeamDiscretisation, NamesWhatIsOutOfRange) {
  const auto field_of = [](const BeamDiscretisation& discretisation) -> std::string {
    try {
      discretisation.validate();
    } catch (const Error& error) {
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(field_of({}), "");
  EXPECT_EQ(field_of({64, 0.1}), "");
  EXPECT_EQ(field_of({0, {}}), "elements_per_member");
  EXPECT_EQ(field_of({65, {}}), "elements_per_member");
  EXPECT_EQ(field_of({{}, 0.0}), "tolerance");
  EXPECT_EQ(field_of({{}, 0.11}), "tolerance");
  EXPECT_EQ(field_of({{}, std::numeric_limits<double>::quiet_NaN()}), "tolerance");
  EXPECT_EQ(field_of({{}, {}, 0}), "max_elements");
}

TEST(MemberResults, AreThoseAtTheEndsOfMembersAndSumsAlongThem) {
  BeamModel model = limber::testing::cantilever_model(4, 0.1);
  model.sections[0].young = model.sections[0].yield_stress = 1;
  model.sections[0].fibre_2 = model.sections[0].fibre_3 = 1;
  const Subdivision cut(model, {3, 1, 2, 4});
  const BeamStructure parts(cut_model(model, cut)), whole(model);
  const BeamSolution fine = find_equilibrium(parts), coarse = find_equilibrium(whole);
  const BeamResults of_parts = results_of(parts, fine.state);
  const BeamResults members = member_results(of_parts, cut);
  const BeamResults expected = results_of(whole, coarse.state);
  ASSERT_EQ(members.forces.size(), 4U);
  EXPECT_LT((members.reaction_forces - expected.reaction_forces).norm(), 1e-9);
  EXPECT_LT((members.reaction_moments - expected.reaction_moments).norm(), 1e-5);
  for (std::size_t e = 0; e < 4; ++e) {
    EXPECT_NEAR(members.forces[e].start_moment_2, expected.forces[e].start_moment_2, 1e-5) << e;
    EXPECT_NEAR(members.forces[e].finish_moment_2, expected.forces[e].finish_moment_2, 1e-5) << e;
    EXPECT_NEAR(members.forces[e].shear_3, expected.forces[e].shear_3, 1e-4) << e;
    EXPECT_NEAR(members.forces[e].axial, expected.forces[e].axial, 1e-4) << e;
    EXPECT_NEAR(members.element_energies[e], expected.element_energies[e], 1e-6) << e;
    EXPECT_NEAR(members.stresses[e].equivalent, expected.stresses[e].equivalent, 1e-4) << e;
  }
  EXPECT_DOUBLE_EQ(members.energies.total(), of_parts.energies.total());
}

}  // namespace
}  // namespace limber::beams
