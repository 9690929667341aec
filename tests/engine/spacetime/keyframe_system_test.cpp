#include "engine/spacetime/keyframe_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "engine/spacetime/newton_step.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/dense.h"

namespace limber::spacetime {
namespace {

using testing::LinearKinematics;
using testing::uniform;

enum class Modes { kFirst, kMixed, kFewer };  // S = I; a full square S; R > r
enum class Rows { kSoft, kExact, kBoth };
enum class Velocities { kNo, kYes };  // every second position is a mean velocity instead

/// Keyframes and positions in random frames, neighbours and the same frame among them.
struct RandomProblem {
  std::shared_ptr<LinearKinematics> kinematics;
  ModeDynamics dynamics;
  Timeline timeline;
  Eigen::MatrixXd mixing;
  ConstraintSet set;

  RandomProblem(unsigned seed, Modes kind, Rows rows, Ends ends, int keyframes, int positions,
                int frame_count = 24, Velocities velocities = Velocities::kNo) {
    std::mt19937_64 generator(seed);
    const int modes = 3, coordinates = kind == Modes::kFewer ? 5 : 3;
    kinematics = std::make_shared<LinearKinematics>(coordinates, 4, 2.0, seed + 1);
    dynamics = test_dynamics(modes, 18, 0.02);
    timeline = {frame_count, ends.first, ends.last};
    if (kind != Modes::kFirst) {
      mixing.setIdentity(coordinates, modes);
      for (auto& value : mixing.reshaped()) value += 0.4 * uniform(generator);
    }
    std::vector<int> frames;
    for (int frame = 2; frame < frame_count - 2; ++frame) frames.push_back(frame);
    std::shuffle(frames.begin(), frames.end(), generator);
    const auto weight = [&](int i) {
      const bool exact = rows == Rows::kExact || (rows == Rows::kBoth && i % 2 == 0);
      return exact ? PositionConstraint::kExact : std::pow(10, 1.5 + 1.5 * uniform(generator));
    };
    for (int i = 0; i < keyframes; ++i) {
      KeyframeConstraint keyframe{static_cast<ConstraintId>(i + 1),
                                  frames[static_cast<std::size_t>(i)], Eigen::VectorXd(coordinates),
                                  weight(i)};
      for (auto& value : keyframe.coordinates) value = uniform(generator);
      set.keyframes[keyframe.id] = keyframe;
    }
    for (int i = 0; i < positions; ++i) {
      // The first of them in the frame of a soft keyframe: both are met in part.
      const bool beside = i == 0 && keyframes > 1 && rows != Rows::kExact;
      PositionConstraint position;
      position.id = static_cast<ConstraintId>(i + 1);
      position.frame = beside ? frames[1] : frames[static_cast<std::size_t>(keyframes + i)];
      position.site = i % 4;
      position.axes = 1 + static_cast<unsigned>(i) % 7;
      position.weight = weight(i);
      for (auto& value : position.target) value = uniform(generator);
      if (velocities == Velocities::kYes && i % 2 == 1)
        position.since = std::max(0, position.frame - 1 - i % 3);
      set.positions[position.id] = position;
    }
  }

  [[nodiscard]] Solver solver() const {
    Solver made(kinematics, dynamics, timeline, {}, mixing);
    for (const auto& [id, constraint] : set.positions) made.add(constraint);
    for (const auto& [id, keyframe] : set.keyframes) made.add_keyframe(keyframe);
    return made;
  }

  [[nodiscard]] DenseAnswer dense() const {
    std::vector<PositionConstraint> positions;
    std::vector<KeyframeConstraint> keyframes;
    for (const auto& [id, constraint] : set.positions) positions.push_back(constraint);
    for (const auto& [id, keyframe] : set.keyframes) keyframes.push_back(keyframe);
    return dense_optimum(*kinematics, dynamics, timeline, positions, keyframes, mixing);
  }
};

/// What the solver's parts make of a problem, at rest.
struct Parts {
  ModeSystems systems;
  ConstraintRows rows;
  RowState state;

  explicit Parts(const RandomProblem& problem)
      : systems(problem.dynamics, problem.timeline),
        rows(problem.kinematics, problem.mixing,
             static_cast<int>(problem.dynamics.stiffness.size())) {
    rows.rebuild(problem.set, systems.frames());
    systems.set_knots(rows.knots());
    const auto knots = static_cast<Eigen::Index>(rows.knots().size());
    rows.evaluate(Lanes::Zero(systems.lanes(), knots), ConstraintRows::Jacobian::kYes, state);
  }

  [[nodiscard]] Eigen::Index size() const {
    return Eigen::Index{systems.modes()} * systems.kept_count();
  }
  [[nodiscard]] Eigen::VectorXd flat(const Lanes& x) const {
    return x.topRows(systems.modes()).reshaped();
  }
  [[nodiscard]] Lanes lanes(const Eigen::VectorXd& x) const {
    Lanes made = Lanes::Zero(systems.lanes(), systems.kept_count());
    made.topRows(systems.modes()) = x.reshaped(systems.modes(), systems.kept_count());
    return made;
  }
  /// J of all rows over all kept frames.
  [[nodiscard]] Eigen::MatrixXd jacobian() const {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows.count(), size());
    for (int term = 0; term < rows.term_count(); ++term) {
      all.block(rows.row_of(term),
                Eigen::Index{systems.modes()} * systems.kept_of_knot(rows.knot_of(term)), 1,
                systems.modes()) = state.jacobian.col(term).head(systems.modes()).transpose();
    }
    return all;
  }
  [[nodiscard]] bool of_keyframe(int row) const {
    return std::any_of(rows.keyframe_blocks().begin(), rows.keyframe_blocks().end(),
                       [&](const TermBlock& block) {
                         const int first = rows.row_of(block.first);
                         return row >= first && row < first + block.count;
                       });
  }
  /// K + proximal I, column by column.
  [[nodiscard]] Eigen::MatrixXd dense() const {
    Eigen::MatrixXd all(size(), size());
    Lanes product;
    for (Eigen::Index i = 0; i < size(); ++i) {
      systems.apply(lanes(Eigen::VectorXd::Unit(size(), i)), product);
      all.col(i) = flat(product);
    }
    all.diagonal().array() += ModeSystems::kProximal;
    return all;
  }
};

double relative(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).norm() / b.norm();
}

class KeyframeSystems : public ::testing::TestWithParam<Modes> {};

TEST_P(KeyframeSystems, AreTheDenseSystemWithTheKeyframesRows) {
  for (const Rows rows : {Rows::kSoft, Rows::kExact, Rows::kBoth}) {
    for (const int keyframes : {0, 1, 2, 9}) {
      for (const Velocities velocities : {Velocities::kNo, Velocities::kYes}) {
        RandomProblem problem(
            41 + static_cast<unsigned>(keyframes), GetParam(), rows,
            {EndCondition::kPinnedPositionVelocity, EndCondition::kPinnedPosition}, keyframes, 5,
            24, velocities);
        // Rows of three and of four terms in turn.
        if (keyframes % 2 == 0) problem.dynamics.smoothing = 3;
        SCOPED_TRACE(keyframes);
        Parts parts(problem);
        Eigen::MatrixXd all = parts.dense();
        const Eigen::MatrixXd jacobian = parts.jacobian();
        Eigen::MatrixXd positions(static_cast<Eigen::Index>(parts.rows.position_rows().size()),
                                  parts.size());
        Eigen::Index at = 0;
        for (int row = 0; row < parts.rows.count(); ++row) {
          if (parts.of_keyframe(row)) {
            all += parts.rows.weight()[row] * jacobian.row(row).transpose() * jacobian.row(row);
          } else {
            positions.row(at++) = jacobian.row(row);
          }
        }
        ASSERT_EQ(at, positions.rows());
        KeyframeSystem system;
        system.factor(parts.systems, parts.rows);
        const Eigen::VectorXd x = positions.colwise().sum().transpose();
        Lanes solved = parts.lanes(x);
        system.solve(parts.systems, solved);
        EXPECT_LT(relative(parts.flat(solved), reference::solve_symmetric(all, x)), 1e-8);
        Eigen::MatrixXd response;
        system.response(parts.systems, parts.rows, parts.state.jacobian, response);
        const Eigen::MatrixXd wanted =
            positions * reference::solve_symmetric(all, positions.transpose());
        EXPECT_LT(relative(response.triangularView<Eigen::Lower>().toDenseMatrix(),
                           wanted.triangularView<Eigen::Lower>().toDenseMatrix()),
                  1e-8);
        // What the ramp measures weights by: K alone, at each knot.
        const Eigen::MatrixXd inverse = reference::solve_symmetric(
            parts.dense(), Eigen::MatrixXd::Identity(parts.size(), parts.size()));
        Eigen::VectorXd own;
        for (int knot = 0; knot < static_cast<int>(parts.rows.knots().size()); ++knot) {
          parts.systems.response(knot, own);
          const Eigen::VectorXd diagonal = inverse.diagonal().segment(
              Eigen::Index{parts.systems.modes()} * parts.systems.kept_of_knot(knot),
              parts.systems.modes());
          EXPECT_LT(relative(own.head(parts.systems.modes()), diagonal), 1e-7);
        }
      }
    }
  }
}

/// Both lines of the system that NOTATION.md states, for right-hand sides at random.
TEST_P(KeyframeSystems, LetTheSaddleBeSolved) {
  const auto expect_solved = [](const Parts& parts, ConstraintSpace::Form form) {
    std::mt19937_64 generator(52);
    Eigen::VectorXd r(parts.size()), c(parts.rows.count()), m;
    for (auto& value : r) value = uniform(generator);
    for (auto& value : c) value = uniform(generator);
    ConstraintSpace space;
    space.factor(parts.systems, parts.rows, parts.state.jacobian, form);
    EXPECT_EQ(space.form(), form);
    Lanes work = parts.lanes(r), d;
    space.saddle(parts.systems, parts.rows, work, c, d, m);
    const Eigen::MatrixXd jacobian = parts.jacobian();
    const Eigen::VectorXd step = parts.flat(d);
    const Eigen::VectorXd above = parts.dense() * step - jacobian.transpose() * m - r;
    const Eigen::VectorXd below = jacobian * step + m.cwiseQuotient(parts.rows.weight()) - c;
    EXPECT_LT(above.norm(), 1e-9 * (r.norm() + m.norm()));
    EXPECT_LT(below.norm(), 1e-9 * c.norm());
  };
  for (const EndCondition end : {EndCondition::kFree, EndCondition::kCyclic}) {
    for (const int positions : {0, 5, 6}) {
      const RandomProblem problem(51, GetParam(), Rows::kBoth, {end, end}, 7, positions, 24,
                                  positions == 6 ? Velocities::kYes : Velocities::kNo);
      const Parts parts(problem);
      expect_solved(parts, ConstraintSpace::Form::kRows);
      expect_solved(parts, ConstraintSpace::Form::kFrames);
    }
  }
}

/// The factor stands for weights that are no more.
TEST_P(KeyframeSystems, SeeThatAWeightHasChanged) {
  const RandomProblem problem(53, GetParam(), Rows::kExact,
                              {EndCondition::kFree, EndCondition::kFree}, 4, 0);
  Parts parts(problem);
  KeyframeSystem system;
  system.factor(parts.systems, parts.rows);
  const Lanes x = parts.lanes(Eigen::VectorXd::Ones(parts.size()));
  Lanes before = x, after = x, anew = x;
  system.solve(parts.systems, before);
  parts.rows.set_exact_weight(1e-3 * parts.rows.exact_weight());
  system.factor(parts.systems, parts.rows);
  system.solve(parts.systems, after);
  KeyframeSystem other;
  other.factor(parts.systems, parts.rows);
  other.solve(parts.systems, anew);
  EXPECT_EQ(after, anew);
  EXPECT_GT(relative(after, before), 0.1);
}

INSTANTIATE_TEST_SUITE_P(All, KeyframeSystems,
                         ::testing::Values(Modes::kFirst, Modes::kMixed, Modes::kFewer),
                         [](const auto& of) -> std::string {
                           if (of.param == Modes::kFirst) return "FirstCoordinates";
                           return of.param == Modes::kMixed ? "Mixed" : "FewerModes";
                         });

class KeyframeMixes : public ::testing::TestWithParam<Ends> {};

TEST_P(KeyframeMixes, MeetTheDenseAnswer) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    const Rows rows = static_cast<Rows>(seed % 3);
    // Exact rows must be independent: as many of a keyframe as there are modes.
    const bool soft = rows == Rows::kSoft;
    const Modes modes = static_cast<Modes>((seed / 3) % (soft ? 3 : 2));
    const RandomProblem problem(60 + seed, modes, rows, GetParam(), 1 + static_cast<int>(seed), 4);
    SCOPED_TRACE(seed);
    Solver solver = problem.solver();
    const SolveReport report = solver.solve();
    const DenseAnswer dense = problem.dense();
    if (soft) {
      EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
    }
    // Exact rows are met to the constraint tolerance, and what they are off has cost nothing.
    EXPECT_NEAR(report.total_energy, dense.energy, (soft ? 1e-9 : 1e-6) * dense.energy);
    EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
              1e-6 * dense.z.cwiseAbs().maxCoeff());
  }
}

INSTANTIATE_TEST_SUITE_P(All, KeyframeMixes, ::testing::ValuesIn(all_ends()),
                         ::testing::PrintToStringParamName());

TEST(KeyframeSystem, TwoKeyframesInOneFrameAddUp) {
  for (const Modes modes : {Modes::kFirst, Modes::kFewer}) {
    RandomProblem problem(80, modes, Rows::kSoft,
                          {EndCondition::kFree, EndCondition::kPinnedPosition}, 4, 3);
    problem.set.keyframes.at(2).frame = problem.set.keyframes.at(1).frame;
    Solver solver = problem.solver();
    const DenseAnswer dense = problem.dense();
    EXPECT_NEAR(solver.solve().total_energy, dense.energy, 1e-9 * dense.energy);
    EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
              1e-6 * dense.z.cwiseAbs().maxCoeff());
  }
}

/// Without positions the energy is quadratic: a step and a look, however many keyframes there are.
TEST(KeyframeSystem, ManyKeyframesTakeOneStep) {
  constexpr int kFrames = 400;
  for (const Modes modes : {Modes::kFirst, Modes::kMixed}) {
    const RandomProblem problem(90, modes, Rows::kSoft,
                                {EndCondition::kPinnedPositionVelocity, EndCondition::kFree}, 300,
                                0, kFrames);
    Solver solver = problem.solver();
    const SolveReport report = solver.solve();
    EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
    EXPECT_LE(report.iterations, 2);
    EXPECT_LT(report.gradient, 1e-8);
    // The answer is there at once, and the solve leaves it where it is.
    Solver quick = problem.solver();
    quick.correct();
    EXPECT_LE((quick.motion() - solver.motion()).cwiseAbs().maxCoeff(), 1e-6);
  }
}

/// Heavy keyframes in every other frame, soft ones between: eight decades of weight in one band.
TEST(KeyframeSystem, WeightsOfEightDecades) {
  for (const Modes modes : {Modes::kFirst, Modes::kMixed}) {
    RandomProblem problem(91, modes, Rows::kSoft, {EndCondition::kFree, EndCondition::kFree}, 12,
                          3);
    for (auto& [id, keyframe] : problem.set.keyframes) keyframe.weight = id % 2 == 0 ? 1e6 : 1e-2;
    Solver solver = problem.solver();
    const DenseAnswer dense = problem.dense();
    EXPECT_NEAR(solver.solve().total_energy, dense.energy, 1e-9 * dense.energy);
    EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
              1e-6 * dense.z.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace limber::spacetime
