// Long histories of edits: the state must not drift away from what the present problem says.
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/literal_spacetime.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;
using testing::LiteralSpacetime;

TEST(SolverEdits, AddingAndRemovingTenThousandTimesLeavesTheStateWhereItWas) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{50};
  Solver solver(kinematics, test_dynamics(6, 30, 0.01), timeline);
  const auto constraints = test_constraints(*kinematics, 5, timeline, 0.3, 100, 71);
  for (const auto& constraint : constraints) solver.add(constraint);
  const SolveReport before = solver.solve();
  ASSERT_EQ(before.status, SolveStatus::kConverged);
  const Eigen::MatrixXd motion = solver.motion();
  PositionConstraint guest = constraints[1];
  guest.id = 99;
  for (int i = 0; i < 10000; ++i) {
    guest.frame = 3 + i % 44;  // old knots and new ones
    solver.add(guest);
    if (i % 3 == 0) solver.correct();
    if (i % 50 == 0) solver.solve();
    solver.remove(guest.id);
    if (i % 7 == 0) solver.correct();
  }
  const SolveReport after = solver.solve();
  EXPECT_EQ(after.status, SolveStatus::kConverged) << after.message;
  EXPECT_EQ(solver.constraints().size(), constraints.size());
  EXPECT_NEAR(after.total_energy, before.total_energy, 1e-12 * before.total_energy);
  EXPECT_LE((solver.motion() - motion).cwiseAbs().maxCoeff(), 1e-7);
}

// Gauss-Newton from the present motion lets stiff modes pay for what is new and may stay there.
TEST(SolverEdits, ConstraintsAddedOneByOneEndAsLowAsAColdStart) {
  const auto kinematics = std::make_shared<ChainKinematics>(8, 8, 1.0, 2.0, 3);
  const Timeline timeline{120};
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    Solver solver(kinematics, test_dynamics(8, 40, 0.0), timeline);
    Solver cold(kinematics, test_dynamics(8, 40, 0.0), timeline);
    for (const auto& constraint : test_constraints(*kinematics, 20, timeline, 1, 100, seed)) {
      solver.add(constraint);
      const SolveReport warm_report = solver.solve();
      cold.add(constraint);
      cold.cold_start();
      const SolveReport cold_report = cold.solve();
      EXPECT_LE(warm_report.total_energy, (1 + 1e-5) * cold_report.total_energy)
          << "seed " << seed << ", constraint " << constraint.id << ": " << warm_report.message
          << cold_report.message;
    }
  }
}

// From far away, where stiff modes pay for what cannot be reached, back in one move and in small
// ones: each answer is judged against a cold start again after every tenth of a body length.
TEST(SolverEdits, FarDragAndBackEndsAsLowAsAColdSolve) {
  const auto kinematics = std::make_shared<ChainKinematics>(8, 8, 1.0, 2.0, 3);
  const Timeline timeline{80};
  for (const int steps : {1, 7, 30}) {
    Solver solver(kinematics, test_dynamics(8, 40, 0.0), timeline);
    const auto constraints = test_constraints(*kinematics, 3, timeline, 0.3, 100, 9);
    for (const auto& constraint : constraints) solver.add(constraint);
    const double opened = solver.solve().total_energy;
    const Eigen::Vector3d far(3, -4, 5);
    for (int step = 1; step <= 2 * steps; ++step) {
      const double share = 1 - std::abs(1 - static_cast<double>(step) / steps);
      solver.move(constraints[1].id, constraints[1].target + share * far);
      const SolveReport report = solver.solve();
      EXPECT_EQ(report.status, SolveStatus::kConverged) << steps << " " << step << report.message;
    }
    EXPECT_LE(solver.solve().total_energy, (1 + 1e-5) * opened) << steps;
  }
}

// A challenge that is stopped continues where it was: every call gets further.
TEST(SolverEdits, AnAnswerIsFoundInSingleSteps) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{60};
  Solver solver(kinematics, test_dynamics(6, 40, 0.0), timeline);
  Solver other(kinematics, test_dynamics(6, 40, 0.0), timeline);
  for (const auto& constraint : test_constraints(*kinematics, 6, timeline, 0.5, 100, 5)) {
    solver.add(constraint);
    other.add(constraint);
    SolveReport report;
    int calls = 0;
    do {
      report = solver.solve({}, [](const SolveReport&) { return false; });
      ASSERT_LT(++calls, 300);
    } while (report.status == SolveStatus::kImproved);
    EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
    const SolveReport at_once = other.solve();
    EXPECT_NEAR(report.total_energy, at_once.total_energy, 1e-6 * at_once.total_energy);
  }
}

TEST(SolverEdits, AddingAndRemovingWithoutAnAnswerBetweenChangesNoBit) {
  const auto kinematics = std::make_shared<ChainKinematics>(6, 6, 1.0, 2.0, 3);
  const Timeline timeline{50};
  Solver solver(kinematics, test_dynamics(6, 30, 0.01), timeline);
  const auto constraints = test_constraints(*kinematics, 5, timeline, 0.3, 100, 71);
  for (const auto& constraint : constraints) solver.add(constraint);
  solver.solve();
  const Eigen::MatrixXd motion = solver.motion();
  PositionConstraint guest = constraints[1];
  guest.id = 99;
  for (int i = 0; i < 10000; ++i) {
    solver.add(guest);
    solver.remove(guest.id);
  }
  EXPECT_EQ(solver.motion(), motion);
}

/// Draws edits of every kind; at most `kMaxConstraints` constraints at a time.
template <class Kinematics>
class RandomEditor {
 public:
  RandomEditor(const Kinematics& kinematics, int sites, int frames, double exact_share)
      : kinematics_(kinematics), sites_(sites), frames_(frames), exact_share_(exact_share) {}

  void edit(Solver& solver) {
    const double kind = chance();
    if (ids_.empty() || (kind < 0.1 && ids_.size() < kMaxConstraints)) {
      ids_.push_back(next_id_++);
      solver.add(constraint(ids_.back()));
    } else if (kind < 0.2 && ids_.size() > 2) {
      const std::size_t which = pick();
      solver.remove(ids_[which]);
      ids_.erase(ids_.begin() + static_cast<std::ptrdiff_t>(which));
    } else if (kind < 0.3) {
      solver.replace(constraint(ids_[pick()]));
    } else {
      solver.move(ids_[pick()], target(sites_ - 1));
    }
  }

 private:
  static constexpr std::size_t kMaxConstraints = 6;

  double chance() { return 0.5 + 0.5 * testing::uniform(generator_); }
  std::size_t pick() { return generator_() % ids_.size(); }

  /// Within reach: where a random z of the body takes the site.
  Eigen::Vector3d target(int site) {
    Eigen::MatrixXd z(kinematics_.coordinate_count(), 1);
    for (auto& value : z.reshaped()) value = 0.2 * testing::uniform(generator_);
    Eigen::Matrix3Xd u;
    const int frame = 0;
    const reduced::SiteQuery query{site, 0};
    kinematics_.evaluate({&frame, 1}, z, {&query, 1}, u, nullptr);
    return u.col(0);
  }

  PositionConstraint constraint(ConstraintId id) {
    PositionConstraint made;
    made.id = id;
    // One frame for each id while it lives: two exact rows never meet in one frame.
    made.frame = 2 + static_cast<int>(id * 5 % static_cast<ConstraintId>(frames_ - 4));
    made.site = static_cast<int>(generator_() % static_cast<std::uint64_t>(sites_));
    made.axes = 1 + static_cast<unsigned>(generator_() % 7);
    made.weight = chance() < exact_share_ ? PositionConstraint::kExact : 20 + 80 * chance();
    made.target = target(made.site);
    return made;
  }

  const Kinematics& kinematics_;
  int sites_, frames_;
  double exact_share_;
  std::mt19937_64 generator_{72};
  std::vector<ConstraintId> ids_;
  ConstraintId next_id_ = 1;
};

/// A solver that never heard of the edits, only of what they left.
Solver without_history(std::shared_ptr<const reduced::Kinematics> kinematics,
                       const Solver& solver) {
  Solver fresh(std::move(kinematics), solver.dynamics(), solver.timeline());
  for (const auto& constraint : solver.constraints()) fresh.add(constraint);
  return fresh;
}

/// Convex: soft rows and linear kinematics have one optimum, so that any history must end there.
TEST(SolverEdits, HundredThousandRandomEditsEndAtTheColdSolve) {
  const LinearKinematics kinematics(5, 4, 2.0, 73);
  const auto shared = std::make_shared<LinearKinematics>(kinematics);
  const Timeline timeline{30};
  Solver solver(shared, test_dynamics(5, 20, 0.01), timeline);
  RandomEditor editor(kinematics, 4, timeline.frame_count, 0);
  for (int i = 1; i <= 100000; ++i) {
    editor.edit(solver);
    if (i % 10 == 0) solver.correct();
    if (i % 200 == 0) solver.solve();
    if (i % 20000 == 0) solver.set_timeline(EndCondition::kFree, EndCondition::kPinnedPosition);
    if (i % 20000 == 10000)
      solver.set_timeline(EndCondition::kPinnedPosition, EndCondition::kPinnedPositionVelocity);
    if (i % 5000 == 0) solver.set_dynamics(test_dynamics(5, 15 + i / 10000, 0.01));
    if (i % 10000 != 0) continue;
    const SolveReport warm = solver.solve();
    ASSERT_EQ(warm.status, SolveStatus::kConverged) << i << warm.message;
    Solver fresh = without_history(shared, solver);
    const SolveReport cold = fresh.solve();
    ASSERT_NEAR(warm.total_energy, cold.total_energy, 1e-9 * cold.total_energy) << i;
    ASSERT_LE((solver.motion() - fresh.motion()).cwiseAbs().maxCoeff(),
              1e-5 * fresh.motion().cwiseAbs().maxCoeff())
        << i;
    const DenseAnswer dense =
        dense_optimum(kinematics, solver.dynamics(), solver.timeline(), solver.constraints());
    ASSERT_NEAR(warm.total_energy, dense.energy, 1e-9 * dense.energy) << i;
  }
}

/// A bending chain, soft rows: the energies reported are those of the motion, and as good as those
/// of a cold solve. (Minima differ for large motions; these are moderate.)
TEST(SolverEdits, HundredThousandRandomEditsOfANonlinearBody) {
  const ChainKinematics kinematics(4, 4, 0.5, 2.0, 3);
  const auto shared = std::make_shared<ChainKinematics>(kinematics);
  const Timeline timeline{30};
  Solver solver(shared, test_dynamics(4, 25, 0.01), timeline);
  RandomEditor editor(kinematics, 4, timeline.frame_count, 0);
  for (int i = 1; i <= 100000; ++i) {
    editor.edit(solver);
    if (i % 10 == 0) solver.correct();
    if (i % 500 == 0) solver.solve();
    if (i % 10000 != 0) continue;
    const SolveReport warm = solver.solve();
    ASSERT_EQ(warm.status, SolveStatus::kConverged) << i << warm.message;
    Solver fresh = without_history(shared, solver);
    const SolveReport cold = fresh.solve();
    EXPECT_NEAR(warm.total_energy, cold.total_energy, 1e-6 * cold.total_energy) << i;
    LiteralSpacetime literal(shared, solver.dynamics(), timeline, solver.constraints());
    ASSERT_NEAR(warm.total_energy,
                literal.force_energy(solver.motion()) + literal.constraint_energy(solver.motion()),
                1e-9 * warm.total_energy)
        << i;
  }
}

TEST(SolverEdits, RandomEditsWithExactRowsEndAtTheColdSolve) {
  const LinearKinematics kinematics(6, 4, 2.0, 74);
  const auto shared = std::make_shared<LinearKinematics>(kinematics);
  const Timeline timeline{64};
  Solver solver(shared, test_dynamics(6, 25, 0.01), timeline);
  RandomEditor editor(kinematics, 4, timeline.frame_count, 0.5);
  for (int i = 1; i <= 5000; ++i) {
    editor.edit(solver);
    if (i % 10 == 0) solver.correct();
    if (i % 500 != 0) continue;
    const SolveReport warm = solver.solve();
    ASSERT_EQ(warm.status, SolveStatus::kConverged) << i << warm.message;
    EXPECT_LE(warm.max_exact_error, 1e-8 * kinematics.length());
    const DenseAnswer dense =
        dense_optimum(kinematics, solver.dynamics(), solver.timeline(), solver.constraints());
    ASSERT_NEAR(warm.total_energy, dense.energy, 1e-6 * dense.energy) << i;
  }
}

/// Constraints that act in a window alone.
class LocalEdits : public ::testing::TestWithParam<Ends> {
 protected:
  static constexpr int kFrames = 90;

  std::shared_ptr<testing::ChainKinematics> chain_ =
      std::make_shared<testing::ChainKinematics>(6, 8, 1.0, 2.0, 3);
  Timeline timeline_{kFrames, GetParam().first, GetParam().last};

  [[nodiscard]] static ModeDynamics calm() {
    ModeDynamics dynamics = test_dynamics(6, 30, 0.3);
    dynamics.discretisation = Discretisation::kSampled;
    dynamics.smoothing = 6;
    return dynamics;
  }
  [[nodiscard]] std::vector<PositionConstraint> unlimited() const {
    return test_constraints(*chain_, 4, timeline_, 0.3, 100, 5);
  }
  [[nodiscard]] PositionConstraint local(int frame, int reach, double weight) const {
    PositionConstraint made = test_constraints(*chain_, 1, timeline_, 0.4, weight, 8)[0];
    made.id = 50;
    made.frame = frame;
    made.reach = reach;
    return made;
  }
  [[nodiscard]] Solver solver(const std::vector<PositionConstraint>& constraints) const {
    Solver made(chain_, calm(), timeline_);
    for (const PositionConstraint& constraint : constraints) made.add(constraint);
    return made;
  }
};

TEST_P(LocalEdits, LeaveTheMotionOutsideTheirReach) {
  for (const double weight : {100.0, kExact}) {
    Solver solver = this->solver(unlimited());
    ASSERT_EQ(solver.solve().status, SolveStatus::kConverged);
    const Eigen::MatrixXd before = solver.motion();
    solver.add(local(45, 12, weight));
    const SolveReport report = solver.solve();
    ASSERT_EQ(report.status, SolveStatus::kConverged) << report.message;
    double inside = 0;
    for (int frame = 0; frame < kFrames; ++frame) {
      const double change = (solver.motion().col(frame) - before.col(frame)).cwiseAbs().maxCoeff();
      if (frame < 33 || frame > 57) {
        EXPECT_LE(change, 1e-9) << frame;
      } else {
        inside = std::max(inside, change);
      }
    }
    EXPECT_GT(inside, 0.05);
    // It goes over into the motion outside without a corner.
    for (const int border : {33, 58}) {
      const auto bend = [&](int frame) {
        return (solver.motion().col(frame - 1) - 2 * solver.motion().col(frame) +
                solver.motion().col(frame + 1))
            .norm();
      };
      EXPECT_LT(bend(border), 2 * std::max(bend(border - 3), bend(border + 3)) + 0.02);
    }
    if (weight == kExact) {
      EXPECT_LT(report.max_exact_error, 1e-7);
    }
    solver.remove(50);
    ASSERT_EQ(solver.solve().status, SolveStatus::kConverged);
    EXPECT_LE((solver.motion() - before).cwiseAbs().maxCoeff(), 1e-5);
  }
}

/// The answer is of the constraints, not of the order in which they came.
TEST_P(LocalEdits, DoNotDependOnTheirOrder) {
  auto all = unlimited();
  all.push_back(local(45, 10, 100));
  all.push_back(local(52, 8, 100));
  all.back().id = 51;
  Solver first = solver(all);
  const SolveReport one = first.solve();
  std::reverse(all.begin(), all.end());
  Solver second(chain_, calm(), timeline_);
  for (const PositionConstraint& constraint : all) {
    second.add(constraint);
    second.solve();
  }
  const SolveReport other = second.solve();
  ASSERT_EQ(one.status, SolveStatus::kConverged);
  ASSERT_EQ(other.status, SolveStatus::kConverged);
  EXPECT_NEAR(one.total_energy, other.total_energy, 1e-6 * one.total_energy);
  EXPECT_LE((first.motion() - second.motion()).cwiseAbs().maxCoeff(), 1e-4);
}

TEST_P(LocalEdits, FollowWhatChangesTheWholeMotion) {
  auto all = unlimited();
  Solver solver = this->solver(all);
  solver.add(local(45, 10, 100));
  solver.solve();
  all[0].target *= 1.3;
  solver.move(all[0].id, all[0].target);
  ASSERT_EQ(solver.solve().status, SolveStatus::kConverged);
  Solver base = this->solver(all);
  base.solve();
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame >= 35 && frame <= 55) continue;
    EXPECT_LE((solver.motion().col(frame) - base.motion().col(frame)).cwiseAbs().maxCoeff(), 1e-5)
        << frame;
  }
  solver.set_dynamics(test_dynamics(6, 40, 0.1));
  EXPECT_EQ(solver.solve().status, SolveStatus::kConverged);
}

TEST_P(LocalEdits, OfTheWholeTimeAreOrdinaryOnes) {
  auto all = unlimited();
  all.push_back(local(45, kFrames, 100));
  Solver everywhere = solver(all);
  const SolveReport one = everywhere.solve();
  all.back().reach.reset();
  Solver ordinary = solver(all);
  EXPECT_NEAR(one.total_energy, ordinary.solve().total_energy, 1e-7 * one.total_energy);
}

INSTANTIATE_TEST_SUITE_P(All, LocalEdits, ::testing::ValuesIn(all_ends()),
                         ::testing::PrintToStringParamName());

}  // namespace
}  // namespace limber::spacetime
