// Structures at random: what is reported as a minimum is one by second derivatives that differences
// of forces give, and the negative eigenvalues that are reported are there.

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_columns.h"
#include "tests/support/random_beams.h"

namespace limber::beams {
namespace {

using limber::testing::random_beams;

class BeamRandomStability : public ::testing::TestWithParam<BeamMethod> {};

TEST_P(BeamRandomStability, TheReportedInertiaHoldsByDifferences) {
  int converged = 0, unstable = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const BeamStructure structure(random_beams(seed));
    BeamSolveOptions options;
    options.method = GetParam();
    const BeamSolution found = find_equilibrium(structure, options);
    const BeamReport& report = found.report;
    if (report.converged()) {
      ++converged;
      EXPECT_EQ(report.negative_eigenvalues, 0) << "seed " << seed;
    }
    if (!report.negative_eigenvalues || report.status == BeamStatus::kMechanism) continue;
    EXPECT_EQ(limber::testing::negative_by_differences(structure, found.state),
              *report.negative_eigenvalues)
        << "seed " << seed << ": " << report.message;
    unstable += *report.negative_eigenvalues > 0 ? 1 : 0;
  }
  // The test would say nothing if nothing was found.
  EXPECT_GT(converged, 8);
  if (GetParam() == BeamMethod::kRelaxation) {
    EXPECT_GT(unstable, 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, BeamRandomStability,
                         ::testing::Values(BeamMethod::kChoose, BeamMethod::kNewton,
                                           BeamMethod::kRelaxation),
                         [](const auto& test) -> std::string {
                           if (test.param == BeamMethod::kChoose) return "Chosen";
                           return test.param == BeamMethod::kNewton ? "Newton" : "Relaxation";
                         });

}  // namespace
}  // namespace limber::beams
