// How the solver behaves: anytime, cancellable, deterministic, indifferent to units, and plain
// about bad input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/energy_conformance.h"
#include "tests/support/literal_spacetime.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;
using testing::LiteralSpacetime;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Bench {
  std::shared_ptr<const ChainKinematics> kinematics;
  ModeDynamics dynamics;
  Timeline timeline;
  std::vector<PositionConstraint> constraints;

  [[nodiscard]] Solver solver(SolverOptions options = {}) const {
    Solver made(kinematics, dynamics, timeline, options);
    for (const auto& constraint : constraints) made.add(constraint);
    return made;
  }
  [[nodiscard]] LiteralSpacetime literal() const {
    return {kinematics, dynamics, timeline, constraints};
  }
  [[nodiscard]] double energy(const Eigen::MatrixXd& motion) const {
    LiteralSpacetime method = literal();
    return method.force_energy(motion) + method.constraint_energy(motion);
  }
};

Bench bending_chain(double length = 2.0) {
  Bench bench;
  bench.kinematics = std::make_shared<ChainKinematics>(9, 8, 1.0, length, 3);
  bench.dynamics = test_dynamics(9, 40, 0.01);
  bench.timeline = {80};
  bench.constraints = test_constraints(*bench.kinematics, 6, bench.timeline, 0.5, 100, 81);
  return bench;
}

TEST(SolverEnergy, GradientOfTheReferenceConforms) {
  Bench bench = bending_chain();
  bench.timeline.frame_count = 12;
  bench.constraints = test_constraints(*bench.kinematics, 3, bench.timeline, 0.5, 100, 82);
  LiteralSpacetime literal = bench.literal();
  const auto shaped = [](const Eigen::VectorXd& free) {
    Eigen::MatrixXd z = Eigen::MatrixXd::Zero(9, 12);
    z.middleCols(2, 8).reshaped() = free;
    return z;
  };
  testing::EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& x) {
    return literal.force_energy(shaped(x)) + literal.constraint_energy(shaped(x));
  };
  energy.gradient = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    return literal.gradient(shaped(x)).middleCols(2, 8).reshaped();
  };
  std::mt19937_64 generator(83);
  Eigen::VectorXd x(72);
  for (auto& value : x) value = 0.4 * testing::uniform(generator);
  testing::expect_conforms(energy, x);
}

TEST(SolverEnergy, TheAnswerIsStationaryForAllFrames) {
  const Bench bench = bending_chain();
  Solver solver = bench.solver();
  EXPECT_EQ(solver.solve().status, SolveStatus::kConverged);
  const Eigen::MatrixXd gradient = bench.literal().gradient(solver.motion());
  const Eigen::MatrixXd rest = bench.literal().gradient(Eigen::MatrixXd::Zero(9, 80));
  EXPECT_LE(gradient.cwiseAbs().maxCoeff(), 1e-7 * rest.cwiseAbs().maxCoeff());
}

TEST(SolverEnergy, AgreesWithTheLiteralMethodOnTheSamePath) {
  const Bench bench = bending_chain();
  Solver solver = bench.solver();
  const SolveReport report = solver.solve();
  const auto reference = bench.literal().solve_continued();
  EXPECT_TRUE(reference.converged);
  EXPECT_NEAR(report.total_energy, reference.total_energy, 1e-6 * reference.total_energy);
}

TEST(SolverAnytime, EnergyNeverRisesOnceWarmAndEveryMotionIsTheOneReported) {
  const Bench bench = bending_chain();
  Solver solver = bench.solver();
  solver.solve();
  int calls = 0;
  for (int edit = 0; edit < 20; ++edit) {
    const auto& constraint = bench.constraints[static_cast<std::size_t>(edit) % 6];
    const Eigen::Vector3d aside = Eigen::Vector3d::Unit(edit % 3) * (edit % 2 == 0 ? 0.1 : -0.1);
    solver.move(constraint.id, constraint.target + aside);
    Bench moved = bench;
    moved.constraints = solver.constraints();
    double last = moved.energy(solver.motion());
    const SolveReport first = solver.correct();
    EXPECT_NEAR(first.total_energy, moved.energy(solver.motion()), 1e-9 * first.total_energy);
    EXPECT_LE(first.total_energy, last * (1 + 1e-12));
    last = first.total_energy;
    const SolveReport final_report = solver.solve({}, [&](const SolveReport& report) {
      ++calls;
      EXPECT_EQ(report.status, SolveStatus::kImproved);
      EXPECT_LE(report.total_energy, last * (1 + 1e-9)) << edit;
      EXPECT_NEAR(report.total_energy, moved.energy(solver.motion()), 1e-9 * last);
      last = report.total_energy;
      return true;
    });
    EXPECT_EQ(final_report.status, SolveStatus::kConverged) << final_report.message;
    EXPECT_LE(final_report.total_energy, last * (1 + 1e-12));
  }
  EXPECT_GE(calls, 20);
}

TEST(SolverAnytime, CorrectGainsMostOfASmallMove) {
  const Bench bench = bending_chain();
  Solver solver = bench.solver();
  solver.solve();
  const auto& constraint = bench.constraints[2];
  solver.move(constraint.id, constraint.target + Eigen::Vector3d(0.04, 0, 0));
  Bench moved = bench;
  moved.constraints = solver.constraints();
  const double before = moved.energy(solver.motion());
  const double first = solver.correct().total_energy;
  const double best = solver.solve().total_energy;
  EXPECT_LT(best, first);
  EXPECT_LT(first - best, 0.1 * (before - best));
}

TEST(SolverAnytime, StopsOnRequestAndContinuesLater) {
  const Bench bench = bending_chain();
  Solver solver = bench.solver();
  int rounds = 0;
  SolveReport report;
  do {
    report = solver.solve({}, [](const SolveReport&) { return false; });
    ASSERT_LT(++rounds, 500);
    ASSERT_TRUE(solver.motion().allFinite());
  } while (report.status == SolveStatus::kImproved);
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_GT(rounds, 3);
  EXPECT_NEAR(report.total_energy, bench.solver().solve().total_energy, 1e-6 * report.total_energy);
}

/// A body whose owner wants nothing of it any more once some evaluations were made.
class GivenUpKinematics final : public reduced::Kinematics {
 public:
  explicit GivenUpKinematics(std::shared_ptr<const ChainKinematics> chain)
      : chain_(std::move(chain)) {}
  [[nodiscard]] int coordinate_count() const override { return chain_->coordinate_count(); }
  [[nodiscard]] double length() const override { return chain_->length(); }
  void evaluate(std::span<const int> frames, const Eigen::Ref<const Eigen::MatrixXd>& z,
                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                Eigen::MatrixXd* jacobian) const override {
    if (left-- == 0) throw Error(ErrorCode::kCancelled, "", "nobody wants it");
    chain_->evaluate(frames, z, queries, u, jacobian);
  }

  mutable int left = std::numeric_limits<int>::max();  // evaluations until then

 private:
  std::shared_ptr<const ChainKinematics> chain_;
};

TEST(SolverAnytime, IsGivenUpInsideAnIterationAndContinuesLater) {
  const Bench bench = bending_chain();
  Solver whole = bench.solver();
  whole.solve();
  const Eigen::Vector3d aside(0.3, -0.2, 0.4);
  whole.move(1, bench.constraints[0].target + aside);
  const double best = whole.solve().total_energy;
  Bench moved = bench;
  moved.constraints = whole.constraints();
  const auto kinematics = std::make_shared<GivenUpKinematics>(bench.kinematics);
  int given_up = 0;
  for (int after = 0;; ++after) {
    kinematics->left = std::numeric_limits<int>::max();
    Solver solver(kinematics, bench.dynamics, bench.timeline);
    for (const auto& constraint : bench.constraints) solver.add(constraint);
    solver.solve();
    solver.move(1, bench.constraints[0].target + aside);
    solver.correct();
    double accepted = moved.energy(solver.motion());
    kinematics->left = after;
    const SolveReport report = solver.solve({}, [&](const SolveReport&) {
      accepted = moved.energy(solver.motion());
      return true;
    });
    if (report.status == SolveStatus::kConverged) break;
    ++given_up;
    ASSERT_EQ(report.status, SolveStatus::kImproved) << after;
    EXPECT_LE(moved.energy(solver.motion()), accepted * (1 + 1e-9)) << after;
    kinematics->left = std::numeric_limits<int>::max();
    const SolveReport resumed = solver.solve();
    EXPECT_EQ(resumed.status, SolveStatus::kConverged) << resumed.message;
    EXPECT_NEAR(resumed.total_energy, best, 1e-6 * best) << after;
  }
  EXPECT_GT(given_up, 5);
}

TEST(SolverAnytime, IsGivenUpWithMoreConstraintsThanWereEvaluated) {
  const Bench bench = bending_chain();
  const auto kinematics = std::make_shared<GivenUpKinematics>(bench.kinematics);
  const double best = bench.solver().solve().total_energy;
  int unknown = 0;
  for (int after = 0; after < 8; ++after) {
    kinematics->left = std::numeric_limits<int>::max();
    Solver solver(kinematics, bench.dynamics, bench.timeline);
    for (std::size_t i = 1; i < bench.constraints.size(); ++i) solver.add(bench.constraints[i]);
    solver.solve();
    solver.add(bench.constraints[0]);
    kinematics->left = after;
    try {
      const SolveReport report = solver.solve();
      EXPECT_EQ(report.status, SolveStatus::kImproved);
      if (std::isinf(report.total_energy)) ++unknown;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kCancelled);
    }
    kinematics->left = std::numeric_limits<int>::max();
    EXPECT_NEAR(solver.solve().total_energy, best, 1e-6 * best) << after;
  }
  EXPECT_GT(unknown, 0);
}

TEST(SolverCancellation, LeavesAValidStateThatCanBeSolved) {
  const Bench bench = bending_chain();
  const double best = bench.solver().solve().total_energy;
  for (int after = 0; after < 6; ++after) {
    Solver solver = bench.solver();
    JobContext job;
    int calls = 0;
    if (after == 0) job.cancellation.request();
    const SolveReport report = solver.solve(job, [&](const SolveReport&) {
      if (++calls == after) job.cancellation.request();
      return true;
    });
    EXPECT_EQ(report.status, SolveStatus::kCancelled);
    EXPECT_EQ(calls, after);
    EXPECT_FALSE(report.message.empty());
    ASSERT_TRUE(solver.motion().allFinite());
    EXPECT_NEAR(report.total_energy, bench.energy(solver.motion()), 1e-9 * report.total_energy);
    const SolveReport resumed = solver.solve();
    EXPECT_EQ(resumed.status, SolveStatus::kConverged) << resumed.message;
    EXPECT_NEAR(resumed.total_energy, best, 1e-6 * best);
  }
}

TEST(SolverIterationLimit, IsReportedAndRespected) {
  const Bench bench = bending_chain();
  SolverOptions options;
  options.max_iterations = 2;
  const SolveReport report = bench.solver(options).solve();
  EXPECT_EQ(report.status, SolveStatus::kIterationLimit);
  EXPECT_EQ(report.iterations, 2);
  EXPECT_FALSE(report.message.empty());
}

TEST(SolverDeterminism, RerunsAreBitwiseEqual) {
  const auto run = [] {
    const Bench bench = bending_chain();
    Solver solver = bench.solver();
    solver.solve();
    solver.move(3, {0.1, 0.2, 0.3});
    solver.correct();
    solver.solve();
    solver.remove(2);
    solver.solve();
    return Eigen::MatrixXd(solver.motion());
  };
  const Eigen::MatrixXd first = run();
  EXPECT_GT(first.cwiseAbs().maxCoeff(), 0.1);
  EXPECT_EQ(first, run());
}

TEST(SolverDeterminism, ColdStartForgetsTheHistory) {
  const Bench bench = bending_chain();
  Solver fresh = bench.solver();
  fresh.solve();
  Solver used = bench.solver();
  used.solve();
  used.move(3, {0.1, 0.2, 0.3});
  used.solve();
  used.move(3, bench.constraints[2].target);
  used.cold_start();
  EXPECT_EQ(used.motion().cwiseAbs().maxCoeff(), 0);
  used.solve();
  EXPECT_EQ(used.motion(), fresh.motion());
}

TEST(SolverWarmStart, ReturnsToAMotionFromAColdSolveHalfway) {
  for (const double weight : {100.0, PositionConstraint::kExact}) {
    Bench bench = bending_chain();
    for (auto& constraint : bench.constraints) constraint.weight = weight;
    Solver solver = bench.solver();
    const SolveReport solved = solver.solve();
    ASSERT_EQ(solved.status, SolveStatus::kConverged);
    const Eigen::MatrixXd answer = solver.motion();
    solver.cold_start();
    solver.correct();
    EXPECT_GT((solver.motion() - answer).norm(), 0.01 * answer.norm());
    solver.warm_start(answer, Known::kAnswer);
    EXPECT_NEAR((solver.motion() - answer).norm(), 0, 1e-9 * answer.norm());
    const SolveReport again = solver.solve();
    EXPECT_EQ(again.status, SolveStatus::kConverged);
    EXPECT_NEAR(again.total_energy, solved.total_energy, 1e-8 * solved.total_energy);
    EXPECT_NEAR((solver.motion() - answer).norm(), 0, 1e-4 * answer.norm());
  }
}

TEST(SolverWarmStart, RefusesAMotionOfAnotherShape) {
  Solver solver = bending_chain().solver();
  Eigen::MatrixXd motion = solver.motion();
  EXPECT_THROW(solver.warm_start(motion.leftCols(motion.cols() - 1), Known::kGuess), Error);
  motion(0, 0) = std::nan("");
  EXPECT_THROW(solver.warm_start(motion, Known::kGuess), Error);
}

TEST(SolverDeterminism, OrderOfAddingDoesNotMatter) {
  const Bench bench = bending_chain();
  Bench reversed = bench;
  std::reverse(reversed.constraints.begin(), reversed.constraints.end());
  Solver forwards = bench.solver(), backwards = reversed.solver();
  forwards.solve();
  backwards.solve();
  EXPECT_EQ(forwards.motion(), backwards.motion());
}

TEST(SolverUnits, MillimetresAndMetresGiveTheSameMotion) {
  const Bench metres = bending_chain(2.0), millimetres = bending_chain(2000.0);
  ASSERT_NEAR(millimetres.constraints[0].target.norm(), 1000 * metres.constraints[0].target.norm(),
              1e-6);
  for (const double weight : {100.0, PositionConstraint::kExact}) {
    Bench a = metres, b = millimetres;
    for (auto& constraint : a.constraints) constraint.weight = weight;
    for (auto& constraint : b.constraints) constraint.weight = weight;
    Solver in_metres = a.solver(), in_millimetres = b.solver();
    const SolveReport one = in_metres.solve(), other = in_millimetres.solve();
    EXPECT_EQ(one.status, SolveStatus::kConverged) << one.message;
    EXPECT_EQ(other.status, SolveStatus::kConverged) << other.message;
    EXPECT_NEAR(one.total_energy, other.total_energy, 1e-9 * one.total_energy);
    EXPECT_NEAR(1000 * one.max_constraint_error, other.max_constraint_error,
                1e-6 * other.max_constraint_error + 2e-5);
    EXPECT_LE((in_metres.motion() - in_millimetres.motion()).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(SolverWithoutConstraints, RestsAndConverges) {
  Bench bench = bending_chain();
  bench.constraints.clear();
  Solver solver = bench.solver();
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged);
  EXPECT_EQ(report.total_energy, 0);
  EXPECT_EQ(solver.motion().cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(solver.motion().rows(), 9);
  EXPECT_EQ(solver.motion().cols(), 80);
}

TEST(SolverMixing, IdentityIsTheSameAndARotationFindsTheSameEnergyForEqualModes) {
  const auto kinematics = std::make_shared<LinearKinematics>(4, 3, 1.0, 84);
  ModeDynamics dynamics{Eigen::VectorXd::Constant(2, 0.05), Eigen::VectorXd::Constant(2, 0.01)};
  PositionConstraint constraint;
  constraint.id = 1;
  constraint.frame = 12;
  constraint.site = 1;
  constraint.target = {0.2, -0.1, 0.3};
  const auto energy = [&](const Eigen::MatrixXd& mixing) {
    Solver solver(kinematics, dynamics, {30}, {}, mixing);
    solver.add(constraint);
    const SolveReport report = solver.solve();
    EXPECT_EQ(report.status, SolveStatus::kConverged);
    return report.total_energy;
  };
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(4, 2);
  Eigen::MatrixXd turned = identity;
  turned.topRows(2) << 0.6, -0.8, 0.8, 0.6;
  Eigen::MatrixXd other = Eigen::MatrixXd::Zero(4, 2);
  other(2, 0) = other(3, 1) = 1;
  EXPECT_EQ(energy(identity), energy({}));
  EXPECT_NEAR(energy(turned), energy({}), 1e-12 * energy({}));
  EXPECT_GT(std::abs(energy(other) - energy({})), 1e-3 * energy({}));
}

/// Runs `work`, expects an Error and returns "code field".
template <class Work>
std::string refusal(Work&& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_STRNE(error.what(), "");
    return std::string(to_string(error.code())) + " " + error.field();
  }
  return "accepted";
}

std::string error_text(ErrorCode code, const std::string& field) {
  return std::string(to_string(code)) + " " + field;
}

TEST(SolverBadInput, ConstructionNamesTheMember) {
  const Bench good = bending_chain();
  const auto made = [&](auto&& spoil) {
    Bench bench = good;
    SolverOptions options;
    Eigen::MatrixXd mixing;
    spoil(bench, options, mixing);
    return refusal(
        [&] { Solver(bench.kinematics, bench.dynamics, bench.timeline, options, mixing); });
  };
  const auto invalid = [](const char* field) {
    return error_text(ErrorCode::kInvalidArgument, field);
  };
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.kinematics = nullptr; }), invalid("kinematics"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.dynamics.stiffness[4] = -1; }),
            invalid("dynamics.stiffness"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.dynamics.stiffness[4] = kNan; }),
            invalid("dynamics.stiffness"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.dynamics.damping[0] = kInfinity; }),
            invalid("dynamics.damping"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.dynamics.damping.conservativeResize(5); }),
            invalid("dynamics.damping"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.dynamics = {}; }), invalid("dynamics.stiffness"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.dynamics = test_dynamics(10, 40, 0); }),
            invalid("dynamics.stiffness"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.timeline.frame_count = 2; }),
            invalid("timeline.frame_count"));
  EXPECT_EQ(made([](auto& b, auto&, auto&) { b.timeline.frame_count = 4; }),
            invalid("timeline.frame_count"));
  EXPECT_EQ(made([](auto&, auto& o, auto&) { o.gradient_tolerance = 0; }),
            invalid("options.gradient_tolerance"));
  EXPECT_EQ(made([](auto&, auto& o, auto&) { o.constraint_tolerance = kNan; }),
            invalid("options.constraint_tolerance"));
  EXPECT_EQ(made([](auto&, auto& o, auto&) { o.max_iterations = 0; }),
            invalid("options.max_iterations"));
  EXPECT_EQ(made([](auto&, auto& o, auto&) { o.rank_tolerance = 0.01; }),
            invalid("options.rank_tolerance"));
  EXPECT_EQ(made([](auto&, auto&, auto& m) { m.setIdentity(9, 8); }), invalid("mixing"));
  EXPECT_EQ(made([](auto&, auto&, auto& m) { m.setConstant(9, 9, kNan); }), invalid("mixing"));
  EXPECT_EQ(made([](auto&, auto&, auto&) {}), "accepted");
}

TEST(SolverBadInput, EditsNameTheMemberAndLeaveTheStateIntact) {
  const Bench bench = bending_chain();
  Solver solver = bench.solver();
  solver.solve();
  const Eigen::MatrixXd motion = solver.motion();
  const auto added = [&](auto&& spoil) {
    PositionConstraint constraint = bench.constraints[0];
    constraint.id = 50;
    spoil(constraint);
    const std::string as_new = refusal([&] { solver.add(constraint); });
    constraint.id = 1;
    EXPECT_EQ(refusal([&] { solver.replace(constraint); }), as_new);
    return as_new;
  };
  const auto invalid = [](const char* field) {
    return error_text(ErrorCode::kInvalidArgument, field);
  };
  const auto range = [](const char* field) { return error_text(ErrorCode::kOutOfRange, field); };
  EXPECT_EQ(added([](auto& c) { c.frame = -1; }), range("constraint.frame"));
  EXPECT_EQ(added([](auto& c) { c.frame = 80; }), range("constraint.frame"));
  EXPECT_EQ(added([](auto& c) { c.site = -1; }), range("constraint.site"));
  EXPECT_EQ(added([](auto& c) { c.axes = 0; }), invalid("constraint.axes"));
  EXPECT_EQ(added([](auto& c) { c.axes = 8; }), invalid("constraint.axes"));
  EXPECT_EQ(added([](auto& c) { c.weight = 0; }), invalid("constraint.weight"));
  EXPECT_EQ(added([](auto& c) { c.weight = -kInfinity; }), invalid("constraint.weight"));
  EXPECT_EQ(added([](auto& c) { c.weight = kNan; }), invalid("constraint.weight"));
  EXPECT_EQ(added([](auto& c) { c.target[1] = kNan; }), invalid("constraint.target"));
  EXPECT_EQ(added([](auto& c) { c.target[2] = kInfinity; }), invalid("constraint.target"));
  EXPECT_EQ(refusal([&] { solver.add(bench.constraints[0]); }),
            error_text(ErrorCode::kAlreadyExists, "constraint.id"));
  EXPECT_EQ(refusal([&] { solver.move(1, {0, kNan, 0}); }), invalid("constraint.target"));
  const std::string unknown = error_text(ErrorCode::kNotFound, "constraint.id");
  EXPECT_EQ(refusal([&] { solver.move(77, {0, 0, 0}); }), unknown);
  EXPECT_EQ(refusal([&] { solver.remove(77); }), unknown);
  PositionConstraint stranger = bench.constraints[0];
  stranger.id = 77;
  EXPECT_EQ(refusal([&] { solver.replace(stranger); }), unknown);
  EXPECT_EQ(refusal([&] { solver.set_dynamics(test_dynamics(8, 40, 0)); }),
            invalid("dynamics.stiffness"));
  EXPECT_EQ(solver.motion(), motion);
  EXPECT_EQ(solver.constraints().size(), 6U);
  EXPECT_LE(solver.solve().iterations, 1);
}

}  // namespace
}  // namespace limber::spacetime
