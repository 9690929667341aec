// Constraints on velocities: rows that read two frames.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/newton_system.h"
#include "engine/spacetime/row_products.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/energy_conformance.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;
using testing::uniform;

/// The central difference about a frame.
PositionConstraint velocity_about(ConstraintId id, int frame, reduced::SiteId site,
                                  const Eigen::Vector3d& target, double weight) {
  PositionConstraint constraint;
  constraint.id = id;
  constraint.since = frame - 1;
  constraint.frame = frame + 1;
  constraint.site = site;
  constraint.target = target;
  constraint.weight = weight;
  return constraint;
}

Eigen::Vector3d displacement(const reduced::Kinematics& kinematics, const Eigen::MatrixXd& motion,
                             int frame, reduced::SiteId site) {
  Eigen::Matrix3Xd u;
  const reduced::SiteQuery query{site, 0};
  kinematics.evaluate({&frame, 1}, motion.col(frame), {&query, 1}, u, nullptr);
  return u.col(0);
}

/// From the motion itself, independent of rows [m/frame].
Eigen::Vector3d velocity_of(const reduced::Kinematics& kinematics, const Eigen::MatrixXd& motion,
                            const PositionConstraint& constraint) {
  const int since = constraint.since.value();
  return (displacement(kinematics, motion, constraint.frame, constraint.site) -
          displacement(kinematics, motion, since, constraint.site)) /
         (constraint.frame - since);
}

SolveReport solve(Solver& solver, const std::vector<PositionConstraint>& constraints) {
  for (const auto& constraint : constraints) solver.add(constraint);
  return solver.solve();
}

/// A chain with velocities and positions: frames of their own, shared, and overlapping spans.
struct ChainProblem {
  std::shared_ptr<ChainKinematics> kinematics =
      std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  ModeDynamics dynamics = test_dynamics(6, 30, 0.02);
  Timeline timeline{40};
  ConstraintSet set;

  explicit ChainProblem(double velocity_weight) {
    for (const auto& constraint : test_constraints(*kinematics, 3, timeline, 0.5, 100, 5))
      set.positions[constraint.id] = constraint;
    const int shared = set.positions.at(2).frame;
    for (const int frame : {8, shared, shared + 1, 30}) {
      const auto id = static_cast<ConstraintId>(10 + frame);
      set.positions[id] =
          velocity_about(id, frame, 7, {0.01 * (frame - 20), 0.03, -0.02}, velocity_weight);
    }
    set.positions.at(18).axes = 5;
  }
};

/// Energy, gradient and Hessian of the rows over z of all knots.
class RowsEnergy {
 public:
  RowsEnergy(const ChainProblem& problem, const Eigen::MatrixXd& mixing, int modes)
      : modes_(modes), rows_(problem.kinematics, mixing, modes) {
    rows_.rebuild(problem.set, FreeFrames(problem.timeline));
    Eigen::VectorXd multiplier(rows_.count());
    for (int row = 0; row < rows_.count(); ++row) multiplier[row] = 0.1 * (row % 5 - 2);
    rows_.set_multipliers(multiplier);
  }

  [[nodiscard]] int size() const { return modes_ * static_cast<int>(rows_.knots().size()); }
  [[nodiscard]] int pairs() const { return static_cast<int>(rows_.pairs().size()); }

  [[nodiscard]] double value(const Eigen::VectorXd& z) const {
    return rows_.merit(at(z, ConstraintRows::Jacobian::kNo).residual);
  }
  [[nodiscard]] Eigen::VectorXd gradient(const Eigen::VectorXd& z) const {
    const RowState state = at(z, ConstraintRows::Jacobian::kYes);
    return -jacobian(state).transpose() * multipliers(state);
  }
  [[nodiscard]] Eigen::MatrixXd hessian(const Eigen::VectorXd& z) const {
    const RowState state = at(z, ConstraintRows::Jacobian::kYes);
    const Eigen::MatrixXd j = jacobian(state);
    Eigen::MatrixXd sum = j.transpose() * rows_.weight().asDiagonal() * j;
    std::vector<Eigen::MatrixXd> blocks;
    rows_.curvature(lanes(z), multipliers(state), blocks);
    for (std::size_t knot = 0; knot < blocks.size(); ++knot) {
      const auto first = static_cast<Eigen::Index>(knot) * modes_;
      sum.block(first, first, modes_, modes_) -= blocks[knot];
    }
    return 0.5 * (sum + sum.transpose());
  }

 private:
  [[nodiscard]] Lanes lanes(const Eigen::VectorXd& z) const {
    const auto knots = static_cast<Eigen::Index>(rows_.knots().size());
    Lanes all = Lanes::Zero(padded_lanes(modes_), knots);
    all.topRows(modes_) = z.reshaped(modes_, knots);
    return all;
  }
  [[nodiscard]] RowState at(const Eigen::VectorXd& z, ConstraintRows::Jacobian wanted) const {
    RowState state;
    rows_.evaluate(lanes(z), wanted, state);
    return state;
  }
  [[nodiscard]] Eigen::VectorXd multipliers(const RowState& state) const {
    Eigen::VectorXd shifted;
    rows_.shifted(state.residual, shifted);
    return rows_.weight().cwiseProduct(shifted);
  }
  [[nodiscard]] Eigen::MatrixXd jacobian(const RowState& state) const {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(rows_.count(), size());
    for (int term = 0; term < rows_.term_count(); ++term) {
      j.block(rows_.row_of(term), Eigen::Index{modes_} * rows_.knot_of(term), 1, modes_) +=
          state.jacobian.col(term).head(modes_).transpose();
    }
    return j;
  }

  int modes_;
  ConstraintRows rows_;
};

TEST(VelocityRows, ConformToDifferences) {
  std::mt19937_64 generator(2);
  Eigen::MatrixXd mixing(6, 4);
  for (auto& value : mixing.reshaped()) value = uniform(generator);
  for (const double weight : {3e4, kExact}) {
    for (const bool mixed : {false, true}) {
      const RowsEnergy energy(ChainProblem(weight), mixed ? mixing : Eigen::MatrixXd(),
                              mixed ? 4 : 6);
      ASSERT_EQ(energy.pairs(), 3 * 4 - 1);
      Eigen::VectorXd z(energy.size());
      for (auto& value : z) value = 0.3 * uniform(generator);
      SCOPED_TRACE(weight);
      testing::expect_conforms({[&](const auto& x) { return energy.value(x); },
                                [&](const auto& x) { return energy.gradient(x); },
                                [&](const auto& x) { return energy.hessian(x); },
                                {},
                                {}},
                               z);
    }
  }
}

/// J d, J^T m and H^-1 x against matrices that are written out.
TEST(VelocityRows, SystemsAreThoseOfTheAssembledMatrices) {
  const ChainProblem problem(3e4);
  ModeSystems systems(problem.dynamics, problem.timeline);
  ConstraintRows rows(problem.kinematics, {}, systems.modes());
  rows.rebuild(problem.set, systems.frames());
  systems.set_knots(rows.knots());
  const int modes = systems.modes(), size = modes * systems.kept_count();
  std::mt19937_64 generator(4);
  Lanes z = Lanes::Zero(systems.lanes(), static_cast<Eigen::Index>(rows.knots().size()));
  for (auto& value : z.topRows(modes).reshaped()) value = 0.3 * uniform(generator);
  RowState state;
  rows.evaluate(z, ConstraintRows::Jacobian::kYes, state);
  std::vector<Eigen::MatrixXd> curvature;
  rows.curvature(z, Eigen::VectorXd::Constant(rows.count(), 0.01), curvature);

  const auto flat = [&](const Lanes& x) -> Eigen::VectorXd { return x.topRows(modes).reshaped(); };
  const auto lanes = [&](const Eigen::VectorXd& x) {
    Lanes made = Lanes::Zero(systems.lanes(), systems.kept_count());
    made.topRows(modes) = x.reshaped(modes, systems.kept_count());
    return made;
  };
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(rows.count(), size), h(size, size);
  for (int term = 0; term < rows.term_count(); ++term)
    j.block(rows.row_of(term), modes * systems.kept_of_knot(rows.knot_of(term)), 1, modes) =
        state.jacobian.col(term).head(modes).transpose();
  Lanes product;
  for (int i = 0; i < size; ++i) {
    systems.apply(lanes(Eigen::VectorXd::Unit(size, i)), product);
    h.col(i) = flat(product);
  }
  h.diagonal().array() += ModeSystems::kProximal;
  h += j.transpose() * rows.weight().asDiagonal() * j;
  NewtonGuard guard;
  for (std::size_t knot = 0; knot < curvature.size(); ++knot) {
    const int at = modes * systems.kept_of_knot(static_cast<int>(knot));
    h.block(at, at, modes, modes) -= guard.part() * curvature[knot];
  }

  Eigen::VectorXd x(size), m(rows.count());
  for (auto& value : x) value = uniform(generator);
  for (auto& value : m) value = uniform(generator);
  const RowProducts products{systems, rows, state.jacobian};
  Eigen::VectorXd along;
  products.multiply(lanes(x), along);
  EXPECT_LT((along - j * x).norm(), 1e-13 * along.norm());
  Lanes transposed = Lanes::Zero(systems.lanes(), systems.kept_count());
  products.add_transposed(m, transposed);
  EXPECT_LT((flat(transposed) - j.transpose() * m).norm(), 1e-13 * transposed.norm());

  NewtonSystem newton;
  ASSERT_TRUE(newton.factor(systems, rows, state.jacobian, curvature, guard));
  Lanes solved = lanes(x);
  newton.solve(solved);
  const Eigen::LLT<Eigen::MatrixXd> llt(h);
  ASSERT_EQ(llt.info(), Eigen::Success);
  EXPECT_LT((flat(solved) - llt.solve(x)).norm(), 1e-8 * flat(solved).norm());
}

class VelocityEnds : public ::testing::TestWithParam<Ends> {};

/// Linear kinematics: the optimum is that of a dense solve in long double. Spans of one, two and
/// more frames, some from a frame that an end holds.
TEST_P(VelocityEnds, AreTheDenseOptimum) {
  const LinearKinematics kinematics(4, 3, 1.0, 21);
  const ModeDynamics dynamics = test_dynamics(4, 15, 0.02);
  const Timeline timeline{26, GetParam().first, GetParam().last};
  for (const double weight : {3e3, kExact}) {
    auto constraints = linear_constraints(kinematics, 7, 26, weight, 22);
    for (std::size_t i = 0; i < constraints.size(); i += 2) {
      constraints[i].since = std::max(0, constraints[i].frame - 1 - static_cast<int>(i / 2));
      constraints[i].target *= 0.2;
    }
    constraints[3].frame = *constraints[4].since;  // a position where a velocity begins
    constraints[1].weight = 50;
    const DenseAnswer dense = dense_optimum(kinematics, dynamics, timeline, constraints);
    Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline);
    const SolveReport report = solve(solver, constraints);
    EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
    EXPECT_FALSE(report.rank_deficient) << report.message;
    // Exact rows are met to 1e-8, which their multipliers turn into energy.
    EXPECT_NEAR(report.total_energy, dense.energy, (weight == kExact ? 1e-7 : 1e-9) * dense.energy);
    EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
              1e-6 * dense.z.cwiseAbs().maxCoeff());
  }
}

INSTANTIATE_TEST_SUITE_P(All, VelocityEnds, ::testing::ValuesIn(all_ends()),
                         ::testing::PrintToStringParamName());

TEST(VelocityConstraints, ExactOnesAreMetByTheMotionItself) {
  const ChainProblem problem(kExact);
  Solver solver(problem.kinematics, problem.dynamics, problem.timeline);
  for (const auto& [id, constraint] : problem.set.positions) solver.add(constraint);
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_FALSE(report.rank_deficient) << report.message;
  const double length = problem.kinematics->length();
  const double rounding = 1e-7 * length;
  for (const auto& [id, constraint] : problem.set.positions) {
    if (!constraint.is_velocity()) continue;
    Eigen::Vector3d missed =
        velocity_of(*problem.kinematics, solver.motion(), constraint) - constraint.target;
    for (int axis = 0; axis < 3; ++axis)
      if ((constraint.axes >> axis & 1U) == 0) missed[axis] = 0;
    EXPECT_LT(missed.norm(), rounding) << id;
  }
  EXPECT_LT(report.max_exact_velocity_error, rounding);
  EXPECT_EQ(report.max_exact_error, 0) << "the positions are soft";
  EXPECT_GT(report.max_constraint_error, 1e-4 * length);
  EXPECT_EQ(report.max_velocity_error, report.max_exact_velocity_error);
}

TEST(VelocityConstraints, SoftOnesAreReportedAsVelocities) {
  const ChainProblem problem(2e3);
  Solver solver(problem.kinematics, problem.dynamics, problem.timeline);
  for (const auto& [id, constraint] : problem.set.positions) solver.add(constraint);
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  double largest = 0, energy = report.force_energy;
  const double length = problem.kinematics->length();
  for (const auto& [id, constraint] : problem.set.positions) {
    const Eigen::Vector3d is =
        constraint.is_velocity()
            ? velocity_of(*problem.kinematics, solver.motion(), constraint)
            : displacement(*problem.kinematics, solver.motion(), constraint.frame, constraint.site);
    Eigen::Vector3d missed = constraint.target - is;
    for (int axis = 0; axis < 3; ++axis)
      if ((constraint.axes >> axis & 1U) == 0) missed[axis] = 0;
    if (constraint.is_velocity()) largest = std::max(largest, missed.norm());
    energy += 0.5 * constraint.weight * missed.squaredNorm() / (length * length);
  }
  EXPECT_NEAR(report.max_velocity_error, largest, 1e-9 * largest);
  EXPECT_GT(largest, 1e-5);
  EXPECT_NEAR(report.total_energy, energy, 1e-9 * energy);
  EXPECT_EQ(report.max_exact_velocity_error, 0);
}

/// A challenge sees to it that the answer after edits is no worse than that of a cold start.
TEST(VelocityConstraints, EditsLeadToAnAnswerAsGoodAsAColdStart) {
  const ChainProblem problem(kExact);
  Solver warm(problem.kinematics, problem.dynamics, problem.timeline);
  for (const auto& [id, constraint] : problem.set.positions) warm.add(constraint);
  warm.solve();
  ConstraintSet edited = problem.set;
  edited.positions.at(40).target *= 1.5;
  warm.move(40, edited.positions.at(40).target);
  warm.correct();
  warm.solve();
  edited.positions.at(18).frame = 12;  // another span
  warm.replace(edited.positions.at(18));
  edited.positions.at(2).since = edited.positions.at(2).frame - 1;  // a position becomes a velocity
  edited.positions.at(2).target.setConstant(0.02);
  warm.replace(edited.positions.at(2));
  edited.positions.erase(1);
  warm.remove(1);
  const SolveReport report = warm.solve();
  Solver cold(problem.kinematics, problem.dynamics, problem.timeline);
  for (const auto& [id, constraint] : edited.positions) cold.add(constraint);
  const SolveReport answer = cold.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_EQ(answer.status, SolveStatus::kConverged) << answer.message;
  EXPECT_LE(report.total_energy, (1 + 1e-6) * answer.total_energy);
  const PositionConstraint& exact = edited.positions.at(40);
  const Eigen::Vector3d is = velocity_of(*problem.kinematics, warm.motion(), exact);
  EXPECT_LT((is - exact.target).norm(), 1e-7);
}

/// Exact positions in both frames say all that the velocity between them can.
TEST(VelocityConstraints, DependenceOverTwoFramesIsReported) {
  const auto kinematics = std::make_shared<LinearKinematics>(4, 3, 1.0, 21);
  const ModeDynamics dynamics = test_dynamics(4, 15, 0.02);
  PositionConstraint before, after;
  before.id = 1;
  before.frame = 10;
  before.target = {0.1, 0.05, 0};
  before.weight = kExact;
  after = before;
  after.id = 2;
  after.frame = 12;
  after.target = {0.2, 0, 0.1};
  const Eigen::Vector3d agreeing = (after.target - before.target) / 2;
  for (const bool agree : {true, false}) {
    Solver solver(kinematics, dynamics, {26});
    const Eigen::Vector3d target = agree ? agreeing : Eigen::Vector3d(agreeing.array() + 0.01);
    const SolveReport report =
        solve(solver, {before, after, velocity_about(3, 11, 0, target, kExact)});
    EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
    EXPECT_TRUE(report.rank_deficient);
    EXPECT_EQ(report.dependent_rows, 3);
    EXPECT_EQ(report.message.find("all agree") != std::string::npos, agree) << report.message;
    EXPECT_EQ(report.message.find("m per frame") == std::string::npos, agree) << report.message;
  }
  Solver apart(kinematics, dynamics, {26});
  EXPECT_FALSE(solve(apart, {before, velocity_about(3, 11, 0, agreeing, kExact)}).rank_deficient);
}

/// Both frames held by an end: what is missed cannot change, and is reported.
TEST(VelocityConstraints, BetweenHeldFramesAreMissedForGood) {
  const auto kinematics = std::make_shared<LinearKinematics>(4, 3, 1.0, 21);
  Solver solver(kinematics, test_dynamics(4, 15, 0.02), {26});
  PositionConstraint held;
  held.id = 1;
  held.since = 0;
  held.frame = 1;
  held.target = {0.3, 0, 0.4};
  held.weight = kExact;
  const SolveReport report = solve(solver, {held, velocity_about(2, 12, 1, {0.01, 0, 0}, 1e4)});
  EXPECT_NEAR(report.max_exact_velocity_error, 0.5, 1e-12);
  EXPECT_EQ(report.dependent_rows, 3);
  EXPECT_EQ(report.max_constraint_error, 0);
}

TEST(VelocityConstraints, AreMetWhileTheMaterialIsFitted) {
  ChainProblem problem(kExact);
  Solver solver(problem.kinematics, problem.dynamics, problem.timeline, {},
                first_coordinates(6, 6));
  for (const auto& [id, constraint] : problem.set.positions) solver.add(constraint);
  solver.solve();
  MaterialSolver fit(problem.kinematics, problem.timeline, problem.set,
                     {problem.dynamics, first_coordinates(6, 6)}, solver.motion());
  const MaterialReport report = fit.solve();
  EXPECT_TRUE(report.below_start) << report.message;
  EXPECT_LT(report.max_exact_velocity_error, 1e-4 * problem.kinematics->length());
  for (const auto& [id, constraint] : problem.set.positions) {
    if (!constraint.is_velocity() || constraint.axes != 7) continue;
    const Eigen::Vector3d is =
        velocity_of(*problem.kinematics, fit.material().mixing * fit.motion(), constraint);
    EXPECT_LE((is - constraint.target).norm(), report.max_exact_velocity_error + 1e-12) << id;
  }
}

TEST(VelocityConstraints, NameWhatIsWrongWithTheirFrames) {
  const auto kinematics = std::make_shared<LinearKinematics>(4, 3, 1.0, 21);
  Solver solver(kinematics, test_dynamics(4, 15, 0.02), {26});
  for (const int since : {-1, 12, 13}) {
    PositionConstraint constraint = velocity_about(1, 11, 0, {0, 0, 0}, 1);
    constraint.since = since;
    try {
      solver.add(constraint);
      FAIL() << since;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kOutOfRange);
      EXPECT_EQ(error.field(), "constraint.since");
    }
  }
}

}  // namespace
}  // namespace limber::spacetime
