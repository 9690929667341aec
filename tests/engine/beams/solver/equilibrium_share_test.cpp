#include "engine/beams/solver/equilibrium_share.h"

#include <gtest/gtest.h>

namespace limber::beams::detail {
namespace {

using Verdict = EquilibriumShare::Verdict;

BeamState state_at(double s) {
  BeamState state;
  state.positions = Eigen::Matrix3Xd::Constant(3, 1, s);
  return state;
}

double located(const EquilibriumShare& recorded, double end, double resolution) {
  EquilibriumShare share = recorded;
  return share.locate(resolution, [end](double s, BeamState& state) {
    EXPECT_LE(state.positions(0, 0), end) << "it begins at an equilibrium";
    EXPECT_LT(state.positions(0, 0), s);
    state = state_at(s);
    return s <= end;
  });
}

TEST(BeamEquilibriumShare, IsLocatedByBisectionBehindTheLastEquilibrium) {
  EquilibriumShare share(0, state_at(0));
  EXPECT_EQ(located(share, 0, 1.0 / 64), 0) << "nothing was recorded";
  share.record(0.25, state_at(0.25), Verdict::kEquilibrium);
  EXPECT_EQ(located(share, 0.25, 1.0 / 64), 0.25) << "no step is beyond the end";
  share.record(0.75, state_at(0.75), Verdict::kNone);
  share.record(1, state_at(1), Verdict::kNone);
  for (const double end : {0.3, 0.6, 0.7499}) {
    EXPECT_LE(located(share, end, 1.0 / 64), end);
    EXPECT_GE(located(share, end, 1.0 / 64), end - 1.0 / 64);
  }
}

TEST(BeamEquilibriumShare, AnEquilibriumFurtherOnCounts) {
  EquilibriumShare share(0, state_at(0));
  share.record(0.25, state_at(0.25), Verdict::kNone);
  share.record(0.5, state_at(0.5), Verdict::kEquilibrium);
  EXPECT_EQ(located(share, 0.5, 1.0 / 64), 0.5);
}

}  // namespace
}  // namespace limber::beams::detail
