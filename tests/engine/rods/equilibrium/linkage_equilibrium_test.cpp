#include "engine/rods/equilibrium/linkage_equilibrium.h"

#include <gtest/gtest.h>

#include <cstring>

#include "engine/base/parallel.h"
#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/unknown_scales.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/support/dense.h"

namespace limber::rods {
namespace {

using testing::curved_model;
using testing::grid_model;
using testing::joint_distance;
using testing::total_potential;

/// Everything at once: a pin, an angle, springs at a joint, a vertex beside a joint and between
/// vertices, forces, torques and weight.
Conditions all_conditions(const LinkageState& state) {
  Conditions conditions;
  conditions.pins = {{5}, {0, Hold::kAngle}};
  conditions.angles = {{10, 0.8}};
  conditions.springs = {
      {JointPoint{15}, state.joints()[15].position + Eigen::Vector3d(3, -2, 20), 0.4},
      {VertexPoint{2, 1}, Eigen::Vector3d(90, 10, 30), 0.2},
      {ArcPoint{17, 0.37}, Eigen::Vector3d(60, 80, -10), 0.1}};
  conditions.loads = {{3, Eigen::Vector3d(0.5, -1, 2), Eigen::Vector3d::Zero(), 20}};
  conditions.gravity = {Eigen::Vector3d(0, 0, -9.81), 1e-3};
  return conditions;
}

TEST(LinkageEquilibrium, PotentialIsStationaryAndMinimalInEveryDirection) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  const Conditions conditions = all_conditions(state);
  LinkageEquilibrium equilibrium(model);
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  ASSERT_TRUE(report.converged()) << report.message;
  const double at = total_potential(model, state, conditions);
  EXPECT_NEAR(report.potential(), at, 1e-9 * (1 + std::abs(at)));
  EXPECT_NEAR(state.joints()[10].opening_angle, 0.8, 1e-12);
  Random random(3);
  std::vector<int> held;
  for (int k = 0; k < 6; ++k) held.push_back(model.variables().joint_begin(5) + k);
  for (const int joint : {0, 10})
    held.push_back(model.variables().joint_begin(joint) + kJointAngle);
  for (int direction = 0; direction < 40; ++direction) {
    Eigen::VectorXd x(model.variables().size());
    for (double& value : x) value = random.normal();
    for (const int unknown : held) x[unknown] = 0;
    const double h = 1e-4 / x.cwiseAbs().maxCoeff();
    const double ahead = total_potential(model, state.moved(model, h * x), conditions);
    const double behind = total_potential(model, state.moved(model, -h * x), conditions);
    const double curvature = ahead - 2 * at + behind;
    EXPECT_GT(curvature, 0);
    EXPECT_LT(std::abs(ahead - behind), 1e-3 * curvature);
  }
}

/// Newton's method as plainly as it goes: dense eigenvalues, all made positive, backtracking.
LinkageState dense_newton(const LinkageModel& model, LinkageState state,
                          const Conditions& conditions, const std::vector<int>& free) {
  LinkageAssembly assembly(model);
  CondensedMatrix matrix(model.chains());
  detail::ConditionTerms terms(model, conditions);
  Eigen::VectorXd gradient(model.variables().size());
  for (int round = 0; round < 300; ++round) {
    (void)assembly.hessian(state, gradient, matrix);
    terms.add(state, gradient, matrix);
    const Eigen::MatrixXd whole = matrix.to_sparse();
    const Eigen::MatrixXd part = whole(free, free);
    const auto [values, vectors] = reference::symmetric_eigen(part);
    const Eigen::VectorXd stiff = values.cwiseAbs().cwiseMax(1e-9);
    const Eigen::VectorXd local =
        -vectors * (vectors.transpose() * gradient(free)).cwiseQuotient(stiff);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(gradient.size());
    step(free) = local;
    const double here = total_potential(model, state, conditions);
    double length =
        std::min(1.0, 0.3 / step.tail(9 * model.variables().joints()).cwiseAbs().maxCoeff());
    while (length > 1e-9 &&
           total_potential(model, state.moved(model, length * step), conditions) > here)
      length /= 2;
    if (length <= 1e-9) break;
    state = state.moved(model, length * step);
    if (step.norm() < 1e-10) break;
  }
  return state;
}

TEST(LinkageEquilibrium, AgreesWithDenseNewton) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}};
  conditions.springs = {
      {JointPoint{15}, state.joints()[15].position + Eigen::Vector3d(4, 1, 9), 0.3}};
  conditions.loads = {{12, Eigen::Vector3d(0.2, 0.1, -0.4), Eigen::Vector3d::Zero(), 5}};
  std::vector<int> free;
  for (int i = 0; i < model.variables().size(); ++i) {
    const int own = i - model.variables().joint_begin(0);
    if (own < 0 || own > kJointAngle) free.push_back(i);
  }
  const LinkageState expected = dense_newton(model, state, conditions, free);
  LinkageEquilibrium equilibrium(model);
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  ASSERT_TRUE(report.converged()) << report.message;
  EXPECT_LT(joint_distance(state, expected), 1e-4);
  EXPECT_NEAR(total_potential(model, state, conditions),
              total_potential(model, expected, conditions), 1e-7);
}

TEST(LinkageEquilibrium, MovesAPinWhereItIsSent) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.pins = {{0}, {15}};
  ASSERT_TRUE(equilibrium.solve(state, conditions).converged());
  const Eigen::Vector3d there = state.joints()[15].position + Eigen::Vector3d(-6, -4, 10);
  conditions.pins[1].position = there;
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT((state.joints()[15].position - there).norm(), 1e-9);
}

TEST(LinkageEquilibrium, AMomentTurnsAgainstSprings) {
  // A single crossing, held by a spring at each end of one rod: a moment M about z turns it by
  // about M / (2 k r^2).
  const LinkageModel model = grid_model(3, 3, std::numbers::pi / 2);
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  const LinkageState start = state;
  for (const int j : {0, 2, 6, 8})
    conditions.springs.push_back({JointPoint{j}, state.joints()[j].position, 0.01});
  ASSERT_TRUE(equilibrium.solve(state, conditions).converged());
  const double moment = 2;
  conditions.loads = {{4, Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, moment), 0}};
  const EquilibriumReport report = equilibrium.solve(state, conditions);
  ASSERT_TRUE(report.converged()) << report.message;
  // What the springs bring against it.
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  const Eigen::Vector3d centre = state.joints()[4].position;
  for (const TargetSpring& spring : conditions.springs) {
    const Eigen::Vector3d x = state.joints()[std::get<JointPoint>(spring.at).joint].position;
    torque += (x - centre).cross(Eigen::Vector3d(spring.stiffness * (spring.position - x)));
  }
  EXPECT_NEAR(torque.z(), -moment, 1e-6 * moment);
  EXPECT_GT(joint_distance(state, start), 0.1);
}

TEST(LinkageEquilibrium, WhichJointIsPinnedDoesNotMatterForTheShape) {
  const LinkageModel model = curved_model();
  std::vector<double> energies;
  std::vector<double> spans;
  for (const int joint : {-1, 0, 7, 15}) {
    LinkageState state(model);
    LinkageEquilibrium equilibrium(model);
    Conditions conditions;
    if (joint >= 0) conditions.pins = {{joint}};
    conditions.mean_opening_angle = 0.75;
    ASSERT_TRUE(equilibrium.solve(state, conditions).converged());
    energies.push_back(total_potential(model, state, conditions));
    spans.push_back((state.joints()[15].position - state.joints()[0].position).norm());
  }
  for (std::size_t k = 1; k < energies.size(); ++k) {
    EXPECT_NEAR(energies[k], energies[0], 1e-8 * energies[0]);
    EXPECT_NEAR(spans[k], spans[0], 1e-5 * spans[0]);
  }
}

/// All numbers of a shape.
std::vector<double> numbers_of(const LinkageModel& model, const LinkageState& state) {
  std::vector<double> numbers;
  for (const JointState<double>& joint : state.joints()) {
    for (const double value : joint.position) numbers.push_back(value);
    for (const double value : joint.normal) numbers.push_back(value);
    numbers.push_back(joint.opening_angle);
  }
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (int i = 0; i <= model.variables().edges(s); ++i) {
      for (const double value : state.vertex(model, s, i)) numbers.push_back(value);
    }
  }
  return numbers;
}

/// A curved linkage in equilibrium that a spring pulls at, and the spring elsewhere.
struct PulledLinkage {
  LinkageModel model = curved_model();
  LinkageState state{model};
  LinkageEquilibrium equilibrium{model};
  Conditions conditions;

  explicit PulledLinkage(const Eigen::Vector3d& pull) {
    conditions.pins = {{0}};
    conditions.springs = {{JointPoint{15}, state.joints()[15].position, 5}};
    EXPECT_TRUE(equilibrium.solve(state, conditions).converged());
    conditions.springs[0].position += pull;
  }
};

TEST(LinkageEquilibrium, ShowsACorrectionWithTheLastFactorFirst) {
  for (const double size : {0.5, 5.0, 30.0}) {
    SCOPED_TRACE(size);
    const Eigen::Vector3d pull = size * Eigen::Vector3d(1, -0.5, 1);
    PulledLinkage watched(pull), plain(pull);
    const double before = total_potential(watched.model, watched.state, watched.conditions);
    double last = before;
    int corrections = 0;
    const EquilibriumReport report = watched.equilibrium.solve(
        watched.state, watched.conditions, {}, {}, [&](int iteration, const LinkageState& shown) {
          if (iteration > 0) return;
          ++corrections;
          const double now = total_potential(watched.model, shown, watched.conditions);
          EXPECT_LT(now, last);
          last = now;
        });
    ASSERT_TRUE(report.converged()) << report.message;
    EXPECT_GT(corrections, 0);
    // What it is worth: of what there is to gain.
    const double end = total_potential(watched.model, watched.state, watched.conditions);
    EXPECT_LT(last - end, 0.9 * (before - end));
    // Who watches changes nothing.
    ASSERT_TRUE(plain.equilibrium.solve(plain.state, plain.conditions).converged());
    EXPECT_EQ(numbers_of(plain.model, plain.state), numbers_of(watched.model, watched.state));
  }
}

TEST(LinkageEquilibrium, AnInterruptedSolveContinuesFromItsCorrection) {
  PulledLinkage pulled(Eigen::Vector3d(6, -3, 6)), whole(Eigen::Vector3d(6, -3, 6));
  const double before = total_potential(pulled.model, pulled.state, pulled.conditions);
  Cancellation cancellation;
  double shown = 0;
  const EquilibriumReport report = pulled.equilibrium.solve(
      pulled.state, pulled.conditions, {}, {cancellation, {}}, [&](int, const LinkageState& state) {
        shown = total_potential(pulled.model, state, pulled.conditions);
        cancellation.request();
      });
  EXPECT_EQ(report.status, EquilibriumStatus::kCancelled);
  EXPECT_EQ(report.factorizations, 0);
  const double now = total_potential(pulled.model, pulled.state, pulled.conditions);
  EXPECT_LT(now, before);
  EXPECT_EQ(now, shown);
  ASSERT_TRUE(pulled.equilibrium.solve(pulled.state, pulled.conditions).converged());
  ASSERT_TRUE(whole.equilibrium.solve(whole.state, whole.conditions).converged());
  EXPECT_LT(joint_distance(pulled.state, whole.state), 1e-4);
}

TEST(LinkageEquilibrium, ReactionsTakeThePlaceOfWhatTheyAreOf) {
  const LinkageModel model = testing::curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held;
  held.pins = {{5}, {10, Hold::kMotionAndAngle}};
  held.loads = {{15, Eigen::Vector3d(0.5, 0.2, -1), Eigen::Vector3d::Zero(), 0}};
  held.mean_opening_angle = state.mean_opening_angle() + 0.05;
  held.angles = {{0, state.joints()[0].opening_angle + 0.1}};
  EquilibriumReport report = equilibrium.solve(state, held);
  ASSERT_TRUE(report.converged()) << report.message;
  const std::vector<JointLoad> reactions = equilibrium.reactions(state, held);
  Eigen::Vector3d sum = held.loads[0].force;
  for (const JointLoad& load : reactions) {
    sum += load.force;
    if (load.joint == 5 || load.joint == 10) continue;
    EXPECT_TRUE(load.force.isZero(0) && load.moment.isZero(0));
    if (load.joint != 0) {
      EXPECT_NEAR(load.opening_torque, report.mean_angle_moment,
                  1e-6 * std::abs(report.mean_angle_moment));
    }
  }
  EXPECT_EQ(reactions.size(), 16U);
  EXPECT_LT(sum.norm(), 1e-6);
  // Without them, but with their loads, the shape is still in balance.
  Conditions free;
  free.pins = {{5}};
  free.loads = held.loads;
  for (JointLoad load : reactions) {
    if (load.joint == 5) load.force = load.moment = Eigen::Vector3d::Zero();
    free.loads.push_back(load);
  }
  LinkageState balanced = state;
  report = equilibrium.solve(balanced, free, {.tolerance = 1e-6});
  EXPECT_LE(report.iterations, 1) << report.message;
  EXPECT_LT(testing::joint_distance(state, balanced), 1e-5);
}

TEST(LinkageEquilibrium, RoundingIsNoReaction) {
  const LinkageModel model = testing::grid_model(4, 4, 1.2);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held;
  held.pins = {{0, Hold::kMotionAndAngle}, {15, Hold::kMotionAndAngle}};
  ASSERT_TRUE(equilibrium.solve(state, held).converged());
  EXPECT_TRUE(equilibrium.reactions(state, held).empty());
  held.loads = {{5, Eigen::Vector3d(0, 0, -1e-4), Eigen::Vector3d::Zero(), 0}};
  ASSERT_TRUE(equilibrium.solve(state, held).converged());
  Eigen::Vector3d sum = held.loads[0].force;
  for (const JointLoad& load : equilibrium.reactions(state, held)) sum += load.force;
  EXPECT_LT(sum.norm(), 1e-8);
}

TEST(LinkageEquilibrium, TheSoftestDirectionIsTheLeastResisted) {
  const LinkageModel model = testing::curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held;
  held.pins = {{5}};
  ASSERT_TRUE(equilibrium.solve(state, held).converged());
  const Eigen::VectorXd soft = equilibrium.softest_direction(state, held);
  const auto resistance = [&](const Eigen::VectorXd& v) {
    const double h = 1e-3 / v.cwiseAbs().maxCoeff();
    const double up = testing::total_potential(model, state.moved(model, h * v), held);
    const double down = testing::total_potential(model, state.moved(model, -h * v), held);
    const double here = testing::total_potential(model, state, held);
    return (up - 2 * here + down) / (h * h) /
           v.dot(detail::UnknownScales(model).weights().cwiseProduct(v));
  };
  const double least = resistance(soft);
  EXPECT_GT(least, 0);
  Random random(3);
  for (int k = 0; k < 10; ++k) {
    Eigen::VectorXd other = soft;
    for (double& value : other) value += 0.02 * random.normal() * soft.cwiseAbs().maxCoeff();
    other.segment<6>(model.variables().joint_begin(5)).setZero();
    EXPECT_GT(resistance(other), least);
  }
}

TEST(LinkageEquilibrium, TheSoftestDirectionLeavesWhatIsHeld) {
  const LinkageModel model = testing::curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions held;
  held.pins = {{5}};
  held.mean_opening_angle = state.mean_opening_angle();
  ASSERT_TRUE(equilibrium.solve(state, held).converged());
  const Eigen::VectorXd soft = equilibrium.softest_direction(state, held);
  const ReducedVariables& variables = model.variables();
  EXPECT_EQ(soft.segment<6>(variables.joint_begin(5)), (Eigen::Vector<double, 6>::Zero()));
  double sum = 0, largest = 0;
  for (int j = 0; j < variables.joints(); ++j) {
    const double angle = soft[variables.joint_begin(j) + kJointAngle];
    sum += angle;
    largest = std::max(largest, std::abs(angle));
  }
  EXPECT_GT(largest, 0);
  EXPECT_LE(std::abs(sum), 1e-10 * largest);
}

TEST(LinkageEquilibrium, RerunsAndThreadsGiveTheSameBits) {
  const LinkageModel model = grid_model(9, 9, 0.9);
  std::vector<std::vector<double>> results;
  const int before = thread_count();
  for (const int threads : {1, 1, 2}) {
    set_thread_count(threads);
    LinkageState state(model);
    LinkageEquilibrium equilibrium(model);
    Conditions conditions;
    conditions.pins = {{40}};
    conditions.mean_opening_angle = 1.1;
    conditions.gravity = {Eigen::Vector3d(0.3, 0, -9.81), 1e-3};
    conditions.springs = {{JointPoint{0}, Eigen::Vector3d(5, 5, 30), 0.1}};
    (void)equilibrium.solve(state, conditions);
    results.push_back(numbers_of(model, state));
  }
  set_thread_count(before);
  for (const std::vector<double>& other : results) {
    ASSERT_EQ(other.size(), results[0].size());
    EXPECT_EQ(std::memcmp(other.data(), results[0].data(), other.size() * sizeof(double)), 0);
  }
}

TEST(LinkageEquilibrium, StopsOnRequest) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.mean_opening_angle = 1.4;
  JobContext context;
  int calls = 0;
  const EquilibriumReport report =
      equilibrium.solve(state, conditions, {}, context, [&](int, const LinkageState&) {
        ++calls;
        context.cancellation.request();
      });
  EXPECT_EQ(report.status, EquilibriumStatus::kCancelled);
  EXPECT_EQ(calls, 1);
}

TEST(LinkageEquilibrium, SaysThatItRanOutOfSteps) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  LinkageEquilibrium equilibrium(model);
  Conditions conditions;
  conditions.mean_opening_angle = 1.4;
  EquilibriumOptions options;
  options.max_iterations = 1;
  const EquilibriumReport report = equilibrium.solve(state, conditions, options);
  EXPECT_EQ(report.status, EquilibriumStatus::kIterationLimit);
  EXPECT_GT(report.max_gradient_scaled, options.tolerance);
  EXPECT_FALSE(report.message.empty());
}

TEST(LinkageEquilibrium, RefusesBadOptions) {
  for (const auto& spoil : std::vector<void (*)(EquilibriumOptions&)>{
           [](EquilibriumOptions& o) { o.max_iterations = 0; },
           [](EquilibriumOptions& o) { o.tolerance = 1; },
           [](EquilibriumOptions& o) { o.largest_turn = 2; },
           [](EquilibriumOptions& o) { o.max_escapes = -1; }}) {
    EquilibriumOptions options;
    spoil(options);
    EXPECT_THROW(options.validate(), Error);
  }
}

TEST(LinkageEquilibrium, LeavesTheFactorThatCertifiedWhatItFound) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{5}};
  conditions.mean_opening_angle = state.mean_opening_angle() + 0.1;
  LinkageEquilibrium equilibrium(model);
  EXPECT_EQ(equilibrium.take_factor(), nullptr);
  ASSERT_TRUE(equilibrium.solve(state, conditions).converged());
  const std::unique_ptr<HessianFactor> factor = equilibrium.take_factor();
  ASSERT_NE(factor, nullptr);
  EXPECT_EQ(factor->shift, 0);
  EXPECT_EQ(equilibrium.take_factor(), nullptr) << "it is taken";

  // What it solves is solved: with the matrix assembled anew, pins and the mean angle are held.
  LinkageAssembly assembly(model);
  CondensedMatrix matrix(model.chains());
  Eigen::VectorXd gradient(model.variables().size()), b(gradient.size()), forces(gradient.size());
  assembly.hessian(state, gradient, matrix);
  EXPECT_LT((gradient - factor->gradient).norm(), 1e-12 * gradient.norm());
  Random random(8);
  for (double& value : b) value = random.normal();
  Eigen::VectorXd x = b;
  factor->solve_in_place(x);
  matrix.multiply(x, forces);
  Eigen::VectorXd left = forces - b;
  double angles = 0, moment = 0;
  for (int j = 0; j < model.variables().joints(); ++j) {
    angles += x[model.variables().joint_begin(j) + kJointAngle];
    moment += left[model.variables().joint_begin(j) + kJointAngle] / model.variables().joints();
  }
  EXPECT_NEAR(angles, 0, 1e-9 * x.norm());
  for (int j = 0; j < model.variables().joints(); ++j)
    left[model.variables().joint_begin(j) + kJointAngle] -= moment;
  left.segment<6>(model.variables().joint_begin(5)).setZero();
  EXPECT_EQ(x.segment<6>(model.variables().joint_begin(5)).norm(), 0);
  EXPECT_LT(left.norm(), 1e-9 * forces.norm());
}

TEST(LinkageEquilibrium, ContinuesInOtherMemoryAsIfItsFactorHadNotBeenTaken) {
  const LinkageModel model = curved_model();
  const auto shapes = [&](bool taking) {
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    Conditions conditions;
    conditions.pins = {{5}};
    EXPECT_TRUE(equilibrium.solve(state, conditions).converged());
    const LinkageState first = state;
    std::unique_ptr<HessianFactor> factor;
    for (int k = 1; k <= 3; ++k) {
      if (taking) factor = equilibrium.take_factor(std::move(factor));
      conditions.mean_opening_angle = first.mean_opening_angle() + 0.02 * k;
      equilibrium.expect_step(state, Eigen::VectorXd::Zero(model.variables().size()));
      EXPECT_TRUE(equilibrium.solve(state, conditions).converged());
    }
    return state;
  };
  EXPECT_EQ(joint_distance(shapes(true), shapes(false)), 0);
}

TEST(LinkageEquilibrium, LeavesNoFactorWhereItDidNotConverge) {
  const LinkageModel model = curved_model();
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{5}};
  conditions.mean_opening_angle = state.mean_opening_angle() + 0.4;
  LinkageEquilibrium equilibrium(model);
  EXPECT_FALSE(equilibrium.solve(state, conditions, {.max_iterations = 1}).converged());
  EXPECT_EQ(equilibrium.take_factor(), nullptr);
}

}  // namespace
}  // namespace limber::rods
