// Stability certified from outside: second differences of an energy that shares no code with the
// engine, at a hundred answers to structures at random.

#include <gtest/gtest.h>

#include <cstdint>

#include "engine/beams/solver/equilibrium.h"
#include "engine/beams/structure/elastic.h"
#include "tests/support/independent_beam_energy.h"
#include "tests/support/random_beams.h"

namespace limber::beams {
namespace {

using limber::testing::Bending;
using limber::testing::independent_energy;
using limber::testing::negative_by_independent_energy;
using limber::testing::random_beams;

TEST(BeamIndependentCertificate, TheEnergyIsThatOfTheElements) {
  const BeamStructure structure(random_beams(7));
  const BeamSolution found = find_equilibrium(structure);
  long double sum = 0;
  for (int e = 0; e < structure.elements(); ++e)
    sum += independent_energy(structure, found.state, e);
  const double engine = elastic_energies(structure, found.state).total();
  ASSERT_GT(engine, 0);
  EXPECT_NEAR(static_cast<double>(sum) / engine, 1, 1e-10);
}

TEST(BeamIndependentCertificate, AHundredRandomAnswersHaveTheReportedInertia) {
  int answers = 0, neutral = 0;
  for (std::uint64_t seed = 1001; answers < 100 && seed < 1200; ++seed) {
    const Bending bending = seed % 3 == 0 ? Bending::kAlike : Bending::kDifferent;
    const BeamStructure structure(random_beams(seed, bending));
    const BeamSolution found = find_equilibrium(structure);
    if (!found.report.negative_eigenvalues) continue;
    ++answers;
    if (found.report.converged()) {
      EXPECT_EQ(found.report.negative_eigenvalues, 0);
    }
    EXPECT_EQ(negative_by_independent_energy(structure, found.state),
              *found.report.negative_eigenvalues)
        << "seed " << seed << ": " << found.report.message;
    neutral += found.report.neutral_directions.empty() ? 0 : 1;
  }
  EXPECT_EQ(answers, 100);
  EXPECT_GT(neutral, 0) << "tubes that buckle may rest in any direction";
}

}  // namespace
}  // namespace limber::beams
