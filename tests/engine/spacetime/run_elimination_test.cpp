#include "engine/spacetime/run_elimination.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/random.h"
#include "tests/support/dense.h"

namespace limber::spacetime {
namespace {

using Stretch = Run;  // a name that testing::Test does not hide

constexpr int kRunFrames = 12;
constexpr int kRunModes = 4;

/// A mode at rest (lambda = 0), slow and fast ones, and a damped one; none grows by itself.
ModeCoefficients calm_modes() {
  const Eigen::Vector4d stiffness(0, 0.03, 1.7, 0.4), damping(0, 0, 0.02, 0.1);
  return {(stiffness - damping).array() - 2, 1 + damping.array()};
}

/// The residual rows that a run is in, one mode: columns are all frames.
Eigen::MatrixXd rows_around(const ModeCoefficients& modes, int mode, Run run) {
  std::vector<int> rows;
  for (int i = run.first - 1; i <= run.last + 1; ++i)
    if (i >= 1 && i <= kRunFrames - 2) rows.push_back(i);
  Eigen::MatrixXd matrix =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), kRunFrames);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    matrix(row, rows[r] - 1) = 1;
    matrix(row, rows[r]) = modes.centre[mode];
    matrix(row, rows[r] + 1) = modes.next[mode];
  }
  return matrix;
}

/// Compares the cost of a run and its frames with a dense least squares problem.
/// @param held  frames of the run that are held at zero, of all modes
void expect_dense_elimination(const ModeCoefficients& modes, const Timeline& timeline, Run run,
                              const std::vector<int>& held = {}) {
  SCOPED_TRACE("run " + std::to_string(run.first) + " .. " + std::to_string(run.last));
  const FreeFrames frames(timeline);
  RunElimination elimination(modes, frames);
  const RunCost cost = elimination.eliminate(run);
  ASSERT_EQ(cost.rows.rows(), kRunModes);
  ASSERT_EQ(cost.rows.cols(), 8);
  Random random(17);
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(kRunModes, kRunFrames);
  for (int i = frames.first(); i <= frames.last(); ++i)
    for (int k = 0; k < kRunModes; ++k) z(k, i) = random.uniform(-1, 1);
  const Eigen::MatrixXd around = z;
  elimination.fill(run, 0, z);

  std::vector<int> unknown;
  for (int i = run.first; i <= run.last; ++i)
    if (std::find(held.begin(), held.end(), i) == held.end()) unknown.push_back(i);
  for (int k = 0; k < kRunModes; ++k) {
    SCOPED_TRACE("mode " + std::to_string(k));
    const Eigen::MatrixXd rows = rows_around(modes, k, run);
    Eigen::MatrixXd inside(rows.rows(), static_cast<Eigen::Index>(unknown.size()));
    for (std::size_t c = 0; c < unknown.size(); ++c)
      inside.col(static_cast<Eigen::Index>(c)) = rows.col(unknown[c]);
    Eigen::VectorXd known = around.row(k);
    known.segment(run.first, run.last - run.first + 1).setZero();
    const Eigen::VectorXd right = -(rows * known);
    const Eigen::VectorXd best = reference::ThinQr(inside).least_squares(right);

    Eigen::VectorXd expected = known;
    for (std::size_t c = 0; c < unknown.size(); ++c)
      expected[unknown[c]] = best[static_cast<Eigen::Index>(c)];
    EXPECT_LE((z.row(k).transpose() - expected).norm(), 1e-9 * (1 + expected.norm()));

    const auto at = [&](int frame) { return frames.contains(frame) ? known[frame] : 0.0; };
    const Eigen::Vector4d beside(at(run.first - 2), at(run.first - 1), at(run.last + 1),
                                 at(run.last + 2));
    const double of_rows =
        Eigen::Vector2d(cost.rows.row(k).head(4).dot(beside), cost.rows.row(k).tail(4).dot(beside))
            .squaredNorm();
    EXPECT_NEAR(of_rows, (inside * best - right).squaredNorm(), 1e-10);
  }
}

TEST(RunElimination, InTheMiddleIsTheDenseOne) {
  const Timeline timeline{kRunFrames};
  for (const Stretch run : {Stretch{4, 7}, Stretch{5, 5}, Stretch{4, 5}, Stretch{3, 8}})
    expect_dense_elimination(calm_modes(), timeline, run);
}

TEST(RunElimination, AtEndsThatAreHeldIsTheDenseOne) {
  for (const EndCondition end :
       {EndCondition::kPinnedPosition, EndCondition::kPinnedPositionVelocity}) {
    const Timeline timeline{kRunFrames, end, end};
    const FreeFrames frames(timeline);
    expect_dense_elimination(calm_modes(), timeline, {frames.first(), 5});
    expect_dense_elimination(calm_modes(), timeline, {frames.first(), frames.first()});
    expect_dense_elimination(calm_modes(), timeline, {6, frames.last()});
    expect_dense_elimination(calm_modes(), timeline, {frames.last(), frames.last()});
    expect_dense_elimination(calm_modes(), timeline, {frames.first() + 1, frames.last() - 1});
  }
}

TEST(RunElimination, AFreeEndCostsNothing) {
  const Timeline timeline{kRunFrames, EndCondition::kFree, EndCondition::kFree};
  for (const Stretch run :
       {Stretch{0, 4}, Stretch{7, kRunFrames - 1}, Stretch{kRunFrames - 2, kRunFrames - 1}}) {
    expect_dense_elimination(calm_modes(), timeline, run);
    RunElimination elimination(calm_modes(), FreeFrames(timeline));
    EXPECT_LE(elimination.eliminate(run).rows.norm(), 1e-10);
  }
}

/// lambda = 5: each frame is 2.6 times as far as the one before.
TEST(RunElimination, AModeThatWouldExplodeIsHeldInTheLastFrameOfAFreeEnd) {
  const ModeCoefficients modes{Eigen::Vector4d::Constant(3), Eigen::Vector4d::Ones()};
  const Timeline timeline{kRunFrames, EndCondition::kPinnedPosition, EndCondition::kFree};
  expect_dense_elimination(modes, timeline, {8, kRunFrames - 1}, {kRunFrames - 1});
  // A single frame multiplies it by less than 4.
  expect_dense_elimination(modes, timeline, {kRunFrames - 1, kRunFrames - 1});
}

TEST(RunElimination, DependsOnNoRunBeforeIt) {
  const Timeline timeline{kRunFrames};
  RunElimination fresh(calm_modes(), FreeFrames(timeline));
  RunElimination used(calm_modes(), FreeFrames(timeline));
  (void)used.eliminate({2, 9});
  (void)used.eliminate({5, 6});
  EXPECT_EQ(used.eliminate({4, 7}).rows, fresh.eliminate({4, 7}).rows);
}

TEST(FreeFrames, AreThoseThatTheEndsLeave) {
  EXPECT_EQ(pinned_frames(EndCondition::kFree), 0);
  EXPECT_EQ(pinned_frames(EndCondition::kPinnedPosition), 1);
  EXPECT_EQ(pinned_frames(EndCondition::kPinnedPositionVelocity), 2);
  EXPECT_EQ(pinned_frames(static_cast<EndCondition>(7)), std::nullopt);
  const FreeFrames frames(
      {10, EndCondition::kPinnedPosition, EndCondition::kPinnedPositionVelocity});
  EXPECT_EQ(frames.first(), 1);
  EXPECT_EQ(frames.last(), 7);
  EXPECT_EQ(frames.count(), 7);
  EXPECT_FALSE(frames.contains(0));
  EXPECT_TRUE(frames.contains(1));
  EXPECT_TRUE(frames.contains(7));
  EXPECT_FALSE(frames.contains(8));
  const FreeFrames one({3, EndCondition::kFree, EndCondition::kPinnedPositionVelocity});
  EXPECT_EQ(one.count(), 1);
}

}  // namespace
}  // namespace limber::spacetime
