#include "engine/spacetime/run_elimination.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
ModeDynamics calm_modes(Discretisation discretisation = Discretisation::kDifferences,
                        double smoothing = 0) {
  return {Eigen::Vector4d(0, 0.03, 1.7, 0.4), Eigen::Vector4d(0, 0, 0.02, 0.1), discretisation,
          smoothing};
}

/// Rows of three and of four terms.
std::vector<ModeDynamics> calm_forms() {
  std::vector<ModeDynamics> forms;
  for (const auto form : {Discretisation::kDifferences, Discretisation::kSampled})
    for (const double smoothing : {0.0, 0.5, 4.0}) forms.push_back(calm_modes(form, smoothing));
  return forms;
}

/// The rows that a run is in, one mode: columns are all frames.
Eigen::MatrixXd rows_around(const ModeDynamics& modes, int mode, Run run) {
  const ForceRows rows(modes, kRunFrames);
  const int first = run.first - rows.reach();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(run.last - first + 1, kRunFrames);
  for (int row = first; row <= run.last; ++row)
    for (int term = 0; term <= rows.reach(); ++term)
      if (row + term >= 0 && row + term < kRunFrames)
        matrix(row - first, row + term) = rows.coefficient(row, term)[mode];
  return matrix;
}

/// Compares the cost of a run and its frames with a dense least squares problem.
/// @param held  frames of the run that are held at zero, of all modes
void expect_dense_elimination(const ModeDynamics& modes, const Timeline& timeline, Run run,
                              const std::vector<int>& held = {}) {
  SCOPED_TRACE("run " + std::to_string(run.first) + " .. " + std::to_string(run.last));
  const FreeFrames frames(timeline);
  const ForceRows force_rows(modes, kRunFrames);
  const int reach = force_rows.reach();
  RunElimination elimination(force_rows, frames);
  const RunCost cost = elimination.eliminate(run);
  ASSERT_EQ(cost.rows.rows(), kRunModes);
  ASSERT_EQ(cost.rows.cols(), 2 * reach * reach);
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
    Eigen::VectorXd beside(2 * reach);
    for (int c = 0; c < reach; ++c) {
      beside[c] = at(run.first - reach + c);
      beside[reach + c] = at(run.last + 1 + c);
    }
    double of_rows = 0;
    for (int p = 0; p < reach; ++p)
      of_rows += std::pow(
          cost.rows.row(k).segment(Eigen::Index{2} * reach * p, beside.size()).dot(beside), 2);
    EXPECT_NEAR(of_rows, (inside * best - right).squaredNorm(), 1e-10 * (1 + of_rows));
  }
}

TEST(RunElimination, InTheMiddleIsTheDenseOne) {
  const Timeline timeline{kRunFrames};
  for (const ModeDynamics& modes : calm_forms())
    for (const Stretch run : {Stretch{4, 7}, Stretch{5, 5}, Stretch{4, 5}, Stretch{3, 8}})
      expect_dense_elimination(modes, timeline, run);
}

TEST(RunElimination, AtEndsThatAreHeldIsTheDenseOne) {
  for (const ModeDynamics& modes : calm_forms()) {
    for (const EndCondition end :
         {EndCondition::kPinnedPosition, EndCondition::kPinnedPositionVelocity}) {
      const Timeline timeline{kRunFrames, end, end};
      const FreeFrames frames(timeline);
      expect_dense_elimination(modes, timeline, {frames.first(), 5});
      expect_dense_elimination(modes, timeline, {frames.first(), frames.first()});
      expect_dense_elimination(modes, timeline, {6, frames.last()});
      expect_dense_elimination(modes, timeline, {frames.last(), frames.last()});
      expect_dense_elimination(modes, timeline, {frames.first() + 1, frames.last() - 1});
    }
  }
}

TEST(RunElimination, AtFreeEndsIsTheDenseOne) {
  const Timeline timeline{kRunFrames, EndCondition::kFree, EndCondition::kFree};
  for (const ModeDynamics& modes : calm_forms())
    for (const Stretch run :
         {Stretch{0, 4}, Stretch{7, kRunFrames - 1}, Stretch{kRunFrames - 2, kRunFrames - 1}})
      expect_dense_elimination(modes, timeline, run);
}

/// Of sampled modes the last one: with what they begin costs the force that leads there.
TEST(RunElimination, AFreeEndCostsNothing) {
  const Timeline timeline{kRunFrames, EndCondition::kFree, EndCondition::kFree};
  for (const auto form : {Discretisation::kDifferences, Discretisation::kSampled}) {
    for (const Stretch run :
         {Stretch{0, 4}, Stretch{7, kRunFrames - 1}, Stretch{kRunFrames - 2, kRunFrames - 1}}) {
      const bool costs = form == Discretisation::kSampled && run.first == 0;
      RunElimination elimination(ForceRows(calm_modes(form), kRunFrames), FreeFrames(timeline));
      const Eigen::VectorXd size = elimination.eliminate(run).rows.rowwise().norm();
      EXPECT_LE(size.head(2).maxCoeff(), 1e-10) << "without damping";
      if (costs) {
        EXPECT_GE(size.tail(2).minCoeff(), 1e-3);
      } else {
        EXPECT_LE(size.tail(2).maxCoeff(), 1e-10);
      }
    }
  }
}

/// What a force needs to fade away is all that a free end costs, and nothing where none acts.
TEST(RunElimination, AFreeEndCostsTheForceThatEndsThereWhereForcesAreSmooth) {
  const Timeline timeline{kRunFrames, EndCondition::kFree, EndCondition::kFree};
  const ModeDynamics modes = calm_modes(Discretisation::kSampled, 4);
  RunElimination elimination(ForceRows(modes, kRunFrames), FreeFrames(timeline));
  const RunCost cost = elimination.eliminate({7, kRunFrames - 1});
  for (int k = 0; k < kRunModes; ++k) {
    const ForceStencil stencil = force_stencil(modes, k);
    const Eigen::Vector3d force(stencil.before, stencil.centre, stencil.next);
    for (int p = 0; p < 3; ++p) {
      const Eigen::Vector3d row = cost.rows.row(k).segment(6 * p, 3);
      EXPECT_LE((row - row.dot(force) / force.squaredNorm() * force).norm(), 1e-10) << k;
    }
    EXPECT_GT(cost.rows.row(k).norm(), 0.1) << k;
  }
}

/// lambda = 5: each frame is 2.6 times as far as the one before.
TEST(RunElimination, AModeThatWouldExplodeIsHeldInTheLastFrameOfAFreeEnd) {
  const Timeline timeline{kRunFrames, EndCondition::kPinnedPosition, EndCondition::kFree};
  for (const double smoothing : {0.0, 2.0}) {
    const ModeDynamics modes{Eigen::Vector4d::Constant(5), Eigen::Vector4d::Zero(),
                             Discretisation::kDifferences, smoothing};
    expect_dense_elimination(modes, timeline, {8, kRunFrames - 1}, {kRunFrames - 1});
    // A single frame multiplies it by less than 4.
    expect_dense_elimination(modes, timeline, {kRunFrames - 1, kRunFrames - 1});
  }
}

/// Damping read backwards: both solutions of a mode of omega = 1.5, zeta = 0.4 are 1.8 times as far
/// in each frame before. By differences it is held, sampled it begins as its cost says.
TEST(RunElimination, ADampedModeDoesNotExplodeTowardsAFreeFirstEnd) {
  const Timeline timeline{kRunFrames, EndCondition::kFree, EndCondition::kPinnedPosition};
  for (const double smoothing : {0.0, 2.0}) {
    ModeDynamics modes{Eigen::Vector4d::Constant(2.25), Eigen::Vector4d::Constant(1.2),
                       Discretisation::kSampled, smoothing};
    expect_dense_elimination(modes, timeline, {0, 4});
    expect_dense_elimination(modes, timeline, {0, 0});
    modes.discretisation = Discretisation::kDifferences;
    modes.stiffness.setConstant(0.5);
    expect_dense_elimination(modes, timeline, {0, 4}, {0, 1});
  }
}

TEST(RunElimination, DependsOnNoRunBeforeIt) {
  const Timeline timeline{kRunFrames};
  for (const ModeDynamics& modes : calm_forms()) {
    RunElimination fresh(ForceRows(modes, kRunFrames), FreeFrames(timeline));
    RunElimination used(ForceRows(modes, kRunFrames), FreeFrames(timeline));
    (void)used.eliminate({2, 9});
    (void)used.eliminate({5, 6});
    EXPECT_EQ(used.eliminate({4, 7}).rows, fresh.eliminate({4, 7}).rows);
  }
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
