#include "engine/rods/equilibrium/deployment.h"

#include <gtest/gtest.h>

#include <numbers>

#include "engine/base/degrees.h"
#include "engine/scene/samples/linkage_samples.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using testing::curved_model;
using testing::grid_model;
using testing::joint_distance;
using testing::linkage_file;

class BurdDeployment : public ::testing::TestWithParam<std::pair<int, double>> {};

TEST_P(BurdDeployment, ReachesTheKnownEnergyInFiftySteps) {
  if (!std::filesystem::exists(linkage_file("burd_flat_opt_scaled"))) GTEST_SKIP() << "no data";
  // A rectangle 3 x 0.75 of E = 3000, nu = 0.38; the public code's energies.
  const LinkageModel model(
      build_linkage_graph(scene::read_line_mesh_file(linkage_file("burd_flat_opt_scaled"))),
      GetParam().first, {6750, 5062.5, 316.40625, 386.3121963558732}, BendingForm::kMaterialFrames);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{20}};
  ASSERT_TRUE(equilibrium.solve(state, conditions).converged());
  conditions.mean_opening_angle = 95 * kDegree;
  int frames = 0;
  const DeploymentReport report =
      deploy(equilibrium, state, conditions, {}, {},
             [&](const DeploymentStep& step, const LinkageState& frame) {
               ++frames;
               EXPECT_NEAR(frame.mean_opening_angle(), step.mean_opening_angle, 1e-12);
             });
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  EXPECT_EQ(report.steps_failed, 0);
  EXPECT_EQ(report.jumps, 0);
  EXPECT_EQ(frames, report.steps);
  EXPECT_EQ(report.path.size(), static_cast<std::size_t>(frames));
  EXPECT_NEAR(report.end.energies.total(), GetParam().second, 1e-5 * GetParam().second);
}

INSTANTIATE_TEST_SUITE_P(Subdivisions, BurdDeployment,
                         ::testing::Values(std::pair{5, 43.49874337567044},
                                           std::pair{10, 43.312507597142925},
                                           std::pair{20, 43.27535043206037},
                                           std::pair{40, 43.267049465093265},
                                           std::pair{80, 43.26507852702259}));

/// Held at a joint, and as it lies then.
struct Balanced {
  Balanced() {
    held.pins = {{5}};
    EXPECT_TRUE(equilibrium.solve(state, held).converged());
  }
  LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium{model};
  LinkageState state{model};
  Conditions held;
};

TEST(Deployment, ClosingWhatWasOpenedComesBackToTheStart) {
  Balanced curved;
  auto& [model, equilibrium, state, conditions] = curved;
  const double energy = equilibrium.solve(state, conditions).energies.total();
  const LinkageState start = state;
  conditions.mean_opening_angle = state.mean_opening_angle() + 0.5;
  const DeploymentReport out = deploy(equilibrium, state, conditions);
  EXPECT_EQ(out.status, DeploymentStatus::kReached) << out.message;
  EXPECT_GT(joint_distance(state, start), 10);
  conditions.mean_opening_angle = start.mean_opening_angle();
  const DeploymentReport back = deploy(equilibrium, state, conditions);
  EXPECT_EQ(back.status, DeploymentStatus::kReached) << back.message;
  EXPECT_EQ(out.jumps + back.jumps, 0);
  EXPECT_LT(joint_distance(state, start), 1e-4);
  EXPECT_NEAR(back.end.energies.total(), energy, 1e-8 * (1 + energy));
}

TEST(Deployment, AgainFromTheSameStateTakesTheSamePath) {
  Balanced curved;
  auto& [model, equilibrium, closed, conditions] = curved;
  conditions.mean_opening_angle = closed.mean_opening_angle() + 0.8;
  // Nothing that was learned where the last deployment ended may lead the next one astray.
  std::vector<int> iterations;
  for (int k = 0; k < 3; ++k) {
    LinkageState state = closed;
    const DeploymentReport report = deploy(equilibrium, state, conditions);
    EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
    EXPECT_EQ(report.steps_shortened, 0);
    iterations.push_back(report.iterations);
  }
  EXPECT_LE(iterations[1], iterations[0] + 2);
  EXPECT_EQ(iterations[2], iterations[1]);
}

TEST(Deployment, ByTorquesEndsWhereTheTorquesSolveDirectly) {
  Balanced curved;
  auto& [model, equilibrium, state, conditions] = curved;
  const double before = state.mean_opening_angle();
  LinkageState direct = state;
  Conditions pushed = conditions;
  for (const int j : {0, 3, 12, 15})
    pushed.loads.push_back({j, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 3});
  const DeploymentReport report = deploy(equilibrium, state, conditions, pushed);
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  EXPECT_GT(state.mean_opening_angle(), before + 1e-3);
  ASSERT_TRUE(equilibrium.solve(direct, pushed).converged());
  EXPECT_LT(joint_distance(state, direct), 1e-4);
  // And back, as the torques fade.
  const DeploymentReport back = deploy(equilibrium, state, pushed, conditions);
  EXPECT_EQ(back.status, DeploymentStatus::kReached) << back.message;
  EXPECT_NEAR(state.mean_opening_angle(), before, 1e-6);
}

TEST(Deployment, BySelectedAnglesAndBack) {
  Balanced curved;
  auto& [model, equilibrium, state, conditions] = curved;
  const double energy = equilibrium.solve(state, conditions).energies.total();
  const LinkageState start = state;
  const double first = state.joints()[0].opening_angle, last = state.joints()[15].opening_angle;
  conditions.angles = {{0, first + 0.4}, {15, last - 0.1}};
  const DeploymentReport report = deploy(equilibrium, state, conditions);
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  EXPECT_NEAR(state.joints()[0].opening_angle, first + 0.4, 1e-12);
  EXPECT_NEAR(state.joints()[15].opening_angle, last - 0.1, 1e-12);
  EXPECT_GT(joint_distance(state, start), 1);
  EXPECT_GT(report.end.energies.total(), 1.001 * energy);
  // Where nothing need hold the angles.
  conditions.angles = {{0, first}, {15, last}};
  const DeploymentReport back = deploy(equilibrium, state, conditions);
  EXPECT_EQ(back.status, DeploymentStatus::kReached) << back.message;
  EXPECT_EQ(report.jumps + back.jumps, 0);
  EXPECT_LT(joint_distance(state, start), 1e-4);
  EXPECT_NEAR(back.end.energies.total(), energy, 1e-8 * (1 + energy));
  for (std::size_t j = 0; j < start.joints().size(); ++j)
    EXPECT_NEAR(state.joints()[j].opening_angle, start.joints()[j].opening_angle, 1e-5) << j;
}

/// A shallow roof of two rods, clamped at both ends by springs on their first two vertices.
struct Roof {
  LinkageModel model;
  Conditions held;

  static LineMesh mesh() {
    LineMesh mesh;
    mesh.vertices.resize(3, 3);
    mesh.vertices << -100, 0, 100, 0, 0, 0, 0, 14, 0;
    mesh.edges.resize(2, 2);
    mesh.edges << 0, 1, 1, 2;
    return mesh;
  }
  Roof() : model(build_linkage_graph(mesh()), 12, {20000, 4000, 8000, 5000}) {
    const LinkageState state(model);
    for (const auto& [segment, vertex] :
         {std::pair{0, 0}, std::pair{0, 1}, std::pair{1, 11}, std::pair{1, 12}})
      held.springs.push_back(
          {VertexPoint{segment, vertex}, state.vertex(model, segment, vertex), 2000});
  }
};

TEST(Deployment, AFloatingLinkageIsNotCarriedAwayByExtrapolation) {
  // Its joints are equally far from its middle: in each shape another one might be the nearest.
  const scene::Linkage sample = scene::make_linkage_sample("hyperboloid");
  const LinkageModel model(build_linkage_graph(sample.lines), 5, testing::kStrip);
  for (const bool turns_about_a_spring : {false, true}) {
    LinkageEquilibrium equilibrium(model);
    LinkageState state(model);
    Conditions from;
    if (turns_about_a_spring)
      from.springs.push_back({JointPoint{5}, state.joints()[5].position, 1000});
    ASSERT_TRUE(equilibrium.solve(state, from).converged());
    Conditions to = from;
    to.mean_opening_angle = 50 * kDegree;
    LinkageState before = state;
    const DeploymentReport report =
        deploy(equilibrium, state, from, to, {}, {},
               [&](const DeploymentStep&, const LinkageState& frame) {
                 EXPECT_LT(joint_distance(frame, before), 0.1);  // of 2 m
                 before = frame;
               });
    EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
    EXPECT_EQ(report.jumps + report.branchings, 0);
    EXPECT_LT(report.iterations, 2 * report.steps);
  }
}

TEST(Deployment, ASnapThroughIsAJumpAndSaysSo) {
  const Roof roof;
  LinkageEquilibrium equilibrium(roof.model);
  LinkageState state(roof.model);
  ASSERT_TRUE(equilibrium.solve(state, roof.held).converged());
  ASSERT_GT(state.joints()[0].position.z(), 10);
  Conditions pushed = roof.held;
  pushed.loads = {{0, Eigen::Vector3d(0, 0, -20), Eigen::Vector3d::Zero(), 0}};
  const DeploymentReport report = deploy(equilibrium, state, roof.held, pushed);
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  // A symmetric roof sways before it has reached its limit: the branch continues, unstable.
  EXPECT_EQ(report.jumps, 1) << report.message;
  EXPECT_EQ(report.limit_points, 0) << report.message;
  EXPECT_LT(state.joints()[0].position.z(), -10);
  // Where the path jumps, the height changes at once.
  int jumps = 0;
  for (const DeploymentStep& step : report.path) jumps += step.event == BranchEvent::kJump ? 1 : 0;
  EXPECT_EQ(jumps, 1);
  // Halfway to where a step found the branch lost, and again until that is near: never beyond it.
  EXPECT_LE(report.steps_shortened, 2);
}

TEST(Deployment, TheEndOfABranchIsALimitPointAndSaysSo) {
  const Roof roof;
  LinkageEquilibrium equilibrium(roof.model);
  LinkageState state(roof.model);
  Conditions pushed = roof.held;
  pushed.loads = {{0, Eigen::Vector3d(-4, 4, -20), Eigen::Vector3d::Zero(), 0}};
  ASSERT_TRUE(equilibrium.solve(state, roof.held).converged());
  const DeploymentReport report = deploy(equilibrium, state, roof.held, pushed);
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  EXPECT_EQ(report.limit_points, 1) << report.message;
  EXPECT_EQ(report.jumps, 0) << report.message;
  EXPECT_NE(report.message.find("limit point"), std::string::npos) << report.message;
  EXPECT_LT(state.joints()[0].position.z(), -10);
}

TEST(Deployment, WhatIsReleasedGoesStepByStepToo) {
  Balanced curved;
  auto& [model, equilibrium, state, free] = curved;
  const LinkageState start = state;
  Conditions open = free;
  open.mean_opening_angle = state.mean_opening_angle() + 0.3;
  open.angles = {{0, state.joints()[0].opening_angle + 0.4}};
  ASSERT_EQ(deploy(equilibrium, state, open).status, DeploymentStatus::kReached);
  double before = state.mean_opening_angle(), largest = 0;
  double energy = equilibrium.solve(state, open).energies.total();
  const DeploymentReport back = deploy(
      equilibrium, state, open, free, {}, {}, [&](const DeploymentStep& step, const LinkageState&) {
        largest = std::max(largest, std::abs(step.mean_opening_angle - before));
        before = step.mean_opening_angle;
        EXPECT_LE(step.energy, energy + 1e-9);
        energy = step.energy;
      });
  EXPECT_EQ(back.status, DeploymentStatus::kReached) << back.message;
  EXPECT_LT(joint_distance(state, start), 1e-4);
  EXPECT_GE(back.steps, 8);
  EXPECT_EQ(back.jumps, 0);
  EXPECT_LT(largest, 0.1);
}

/// Its shape is stable while the place is held, and would not be under the force that holds it.
TEST(Deployment, APinThatWasPushedFarIsReleasedWithoutAJump) {
  Balanced curved;
  auto& [model, equilibrium, state, free] = curved;
  const LinkageState start = state;
  Conditions pushed = free;
  const Eigen::Vector3d there = state.joints()[10].position;
  pushed.pins.push_back({10, Hold::kMotion, there + 0.3 * (state.joints()[5].position - there)});
  ASSERT_EQ(deploy(equilibrium, state, free, pushed).status, DeploymentStatus::kReached);
  ASSERT_GT(joint_distance(state, start), 0.1);
  const DeploymentReport back = deploy(equilibrium, state, pushed, free);
  EXPECT_EQ(back.status, DeploymentStatus::kReached) << back.message;
  EXPECT_EQ(back.jumps + back.limit_points + back.branchings, 0) << back.message;
  EXPECT_EQ(back.path.front().progress, 0);
  EXPECT_EQ(back.path.back().progress, 1);
}

TEST(Deployment, WhereItStopsTheShapeIsTheLastEquilibrium) {
  Balanced curved;
  auto& [model, equilibrium, state, conditions] = curved;
  Conditions far = conditions;
  far.pins.push_back({10, Hold::kMotion, Eigen::Vector3d(1e4, 0, 0)});  // rods are shorter
  DeploymentOptions options;
  options.first_step = options.largest_step = 0.05;
  options.smallest_step = 0.02;
  options.last.max_iterations = 3;
  options.patience = 3;
  const DeploymentReport report = deploy(equilibrium, state, conditions, far, options);
  ASSERT_EQ(report.status, DeploymentStatus::kStopped) << report.message;
  EXPECT_EQ(report.steps_failed, 1);
  ASSERT_EQ(report.held.pins.size(), report.steps == 0 ? 1U : 2U);
  EXPECT_EQ(equilibrium.solve(state, report.held, {.tolerance = 1e-3}).iterations, 0);
  if (report.held.pins.size() > 1) {
    ASSERT_TRUE(report.resistance.pin);
    EXPECT_GT(report.resistance.pin->force.norm(), 0);
  }
  EXPECT_FALSE(report.resistance.angle);  // none is set
}

/// Pushed aslant through its base: its branch ends, and then another one.
struct PushedRoof : Roof {
  LinkageEquilibrium equilibrium{model};
  LinkageState start{model};
  Conditions pushed = held;

  PushedRoof() {
    EXPECT_TRUE(equilibrium.solve(start, held).converged());
    pushed.loads = {{0, Eigen::Vector3d(-4, 4, -20), Eigen::Vector3d::Zero(), 0}};
  }
  /// @param state  becomes the end of the path
  DeploymentReport push(const DeploymentOptions& options, LinkageState& state) {
    state = start;
    return deploy(equilibrium, state, held, pushed, options);
  }
  DeploymentReport push(const DeploymentOptions& options) {
    LinkageState state = start;
    return push(options, state);
  }
};

TEST(Deployment, APathThatLosesBranchAfterBranchIsGivenUp) {
  PushedRoof roof;
  DeploymentOptions options;
  options.most_ends = 1;
  LinkageState state = roof.start;
  const DeploymentReport report = roof.push(options, state);
  EXPECT_EQ(report.status, DeploymentStatus::kStopped);
  EXPECT_EQ(report.end.status, EquilibriumStatus::kStalled);
  EXPECT_EQ(report.branchings + report.limit_points + report.jumps, 1) << report.message;
  EXPECT_EQ(report.steps_failed, 1);
  EXPECT_NE(report.message.find("has snapped or buckled once (limit 1)"), std::string::npos)
      << report.message;
  ASSERT_FALSE(report.path.empty());
  EXPECT_NE(report.path.back().event, BranchEvent::kNone);
  EXPECT_LT(report.path.back().progress, 1);
  // The shape is an equilibrium on the branch that it came to.
  EXPECT_LT(state.joints()[0].position.z(), -5);
  EXPECT_EQ(roof.equilibrium.solve(state, report.held, {.tolerance = 1e-3}).iterations, 0);
  options.most_ends = 2;
  EXPECT_EQ(roof.push(options).status, DeploymentStatus::kReached);
}

/// Counted from tenth to tenth: a long path may take as many steps as it needs.
TEST(Deployment, APathThatHardlyAdvancesIsGivenUp) {
  PushedRoof roof;
  DeploymentOptions options;
  const DeploymentReport all = roof.push(options);
  ASSERT_EQ(all.status, DeploymentStatus::kReached);
  ASSERT_GT(all.iterations, 30);

  const auto reaches = [&](int most_iterations) {
    options.most_iterations = most_iterations;
    return roof.push(options).status == DeploymentStatus::kReached;
  };
  int enough = all.iterations;
  while (enough > 1 && reaches(enough - 1)) --enough;
  EXPECT_LT(enough, all.iterations - all.path.back().iterations) << "those of all tenths";
  options.most_iterations = 1;
  LinkageState state = roof.start;
  const DeploymentReport report = roof.push(options, state);
  EXPECT_EQ(report.status, DeploymentStatus::kStopped);
  EXPECT_EQ(report.end.status, EquilibriumStatus::kStalled);
  EXPECT_NE(report.message.find("steps of the solver advanced it only from"), std::string::npos)
      << report.message;
  EXPECT_EQ(report.steps_failed, 1);
  ASSERT_FALSE(report.path.empty());
  EXPECT_LT(report.path.back().progress, 1);
  EXPECT_EQ(roof.equilibrium.solve(state, report.held, {.tolerance = 1e-3}).iterations, 0);
}

TEST(Deployment, ASmallPushDoesNotJump) {
  const Roof roof;
  LinkageEquilibrium equilibrium(roof.model);
  LinkageState state(roof.model);
  ASSERT_TRUE(equilibrium.solve(state, roof.held).converged());
  Conditions pushed = roof.held;
  pushed.loads = {{0, Eigen::Vector3d(0, 0, -0.5), Eigen::Vector3d::Zero(), 0}};
  const DeploymentReport report = deploy(equilibrium, state, roof.held, pushed);
  EXPECT_EQ(report.status, DeploymentStatus::kReached) << report.message;
  EXPECT_EQ(report.jumps, 0);
  EXPECT_GT(state.joints()[0].position.z(), 5);
}

/// The angle of one joint, of three ends or of the two of a corner, when all others but the middle
/// are held and the mean is to grow; in steps however small.
void expect_turned_at_most(int free_joint, int valence, double most) {
  const LinkageModel model = grid_model(3, 3, 0.4);
  ASSERT_EQ(model.graph().joints[static_cast<std::size_t>(free_joint)].valence, valence);
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{4}};
  const int joints = model.variables().joints();
  for (int j = 0; j < joints; ++j)
    if (j != 4 && j != free_joint) conditions.angles.push_back({j, 0.35});
  conditions.mean_opening_angle = 2.8;
  const DeploymentReport report = deploy(equilibrium, state, conditions);
  EXPECT_EQ(report.status, DeploymentStatus::kStopped);
  EXPECT_NE(report.message.find("turn over"), std::string::npos) << report.message;
  const double angle = state.joints()[static_cast<std::size_t>(free_joint)].opening_angle;
  EXPECT_LT(std::abs(angle), 1.01 * most);
  EXPECT_GT(std::abs(angle), 0.8 * most) << "rods block it, but not before";
}

TEST(Deployment, NoJointCreepsBeyondWhereRodsCross) {
  expect_turned_at_most(1, 3, 1.25 * std::numbers::pi);
}

TEST(Deployment, RodsJoinedByTheirEndsOpenUntilTheyFold) {
  expect_turned_at_most(8, 2, 2 * std::numbers::pi);
}

TEST(Deployment, ATorqueThatWindsAJointUpIsGivenUpWhereRodsCross) {
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{0}, {model.variables().joints() - 1}};
  ASSERT_TRUE(equilibrium.solve(state, conditions).converged());
  for (const double torque : {1e3, 1e6}) {
    Conditions wound = conditions;
    wound.loads = {{6, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), torque}};
    LinkageState shape = state;
    const DeploymentReport report = deploy(equilibrium, shape, conditions, wound);
    EXPECT_EQ(report.status, DeploymentStatus::kStopped);
    EXPECT_EQ(report.end.status, EquilibriumStatus::kStalled);
    const std::string text = "joint 6 would turn over, to an opening angle of ";
    const std::size_t at = report.message.find(text);
    ASSERT_NE(at, std::string::npos) << report.message;
    EXPECT_LE(std::abs(std::stod(report.message.substr(at + text.size()))), 180) << "without turns";
    EXPECT_LT(report.iterations, 1200);
    EXPECT_LE(std::abs(shape.joints()[6].opening_angle), 225 * kDegree);
  }
}

TEST(Deployment, StopsOnRequest) {
  const LinkageModel model = curved_model();
  LinkageEquilibrium equilibrium(model);
  LinkageState state(model);
  Conditions conditions;
  conditions.mean_opening_angle = 1.2;
  JobContext context;
  const DeploymentReport report =
      deploy(equilibrium, state, conditions, {}, context,
             [&](const DeploymentStep&, const LinkageState&) { context.cancellation.request(); });
  EXPECT_EQ(report.status, DeploymentStatus::kCancelled);
  EXPECT_EQ(report.steps, 1);
}

TEST(Deployment, RefusesBadOptions) {
  for (const auto& spoil : std::vector<void (*)(DeploymentOptions&)>{
           [](DeploymentOptions& o) { o.first_step = 0; },
           [](DeploymentOptions& o) { o.largest_step = 2; },
           [](DeploymentOptions& o) { o.smallest_step = -1; },
           [](DeploymentOptions& o) { o.jump_turn = 0; },
           [](DeploymentOptions& o) { o.patience = 0; },
           [](DeploymentOptions& o) { o.most_ends = 0; },
           [](DeploymentOptions& o) { o.most_iterations = 0; },
           [](DeploymentOptions& o) { o.last.tolerance = 0; }}) {
    DeploymentOptions options;
    spoil(options);
    EXPECT_THROW(options.validate(), Error);
  }
}

}  // namespace
}  // namespace limber::rods
