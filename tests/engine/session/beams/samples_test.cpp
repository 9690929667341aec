#include "engine/session/beams/samples.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/session/beams/analysis.h"

namespace limber::session {
namespace {

/// The highest node.
double height(const BeamAnalysis& analysis) {
  return analysis.solution.state.positions.row(2).maxCoeff();
}

TEST(BeamSamples, TheArchRisesByWhatItsEndMovesIn) {
  const BeamSample sample = make_beam_sample("arch");
  const BeamAnalysis found = analyse(sample.model, {});
  ASSERT_TRUE(found.solution.report.converged()) << found.solution.report.message;
  EXPECT_GT(height(found), 0.8);
  EXPECT_NEAR(found.solution.state.positions(0, 40), 3.2, 1e-12);
  EXPECT_GT(found.results.largest_utilisation, 0.05);
  EXPECT_LT(found.results.largest_bend, 0.5);
}

TEST(BeamSamples, TheGridshellRisesEvenly) {
  const BeamSample sample = make_beam_sample("gridshell");
  const BeamAnalysis found = analyse(sample.model, {});
  ASSERT_TRUE(found.solution.report.converged()) << found.solution.report.message;
  EXPECT_GT(height(found), 0.7);
  // All of it is above the ground, and as high on the left as on the right.
  const auto& positions = found.solution.state.positions;
  EXPECT_GT(positions.row(2).minCoeff(), -1e-9);
  double left = 0, right = 0;
  for (int i = 0; i < static_cast<int>(sample.model.nodes.size()); ++i) {
    const double x = sample.model.nodes[static_cast<std::size_t>(i)].position.x();
    (x < 0 ? left : right) += x == 0 ? 0 : positions(2, i);
  }
  EXPECT_NEAR(left, right, 1e-3 * (left + right));
  EXPECT_LT(found.results.largest_utilisation, 1);
}

TEST(BeamSamples, OthersAreNotFound) {
  EXPECT_EQ(beam_sample_names().size(), 2U);
  try {
    (void)make_beam_sample("bridge");
    FAIL() << "made";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
  }
}

}  // namespace
}  // namespace limber::session
