// Springs, loads and weight through the one conformance suite; moments by their virtual work.

#include "engine/rods/equilibrium/condition_terms.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/engine/rods/linkage/state_charts.h"
#include "tests/support/energy_conformance.h"

namespace limber::rods {
namespace {

using namespace testing;
using detail::ConditionTerms;
using limber::testing::EnergyUnderTest;

/// On joints, on vertices that joints move and on those that move themselves, on edges of every
/// kind, at free ends and on the rod that touches nothing.
std::vector<TargetSpring> springs_everywhere(const LinkageModel& model) {
  Random random(3);
  const auto target = [&] {
    const double x = random.uniform(-3, 3), y = random.uniform(-3, 3);
    return Eigen::Vector3d(x, y, random.uniform(-3, 3));
  };
  std::vector<TargetSpring> springs = {{JointPoint{0}, target(), 4}, {JointPoint{4}, target(), 2}};
  for (int s = 0; s < model.variables().segments(); ++s) {
    const int edges = model.variables().edges(s);
    springs.push_back({VertexPoint{s, s % (edges + 1)}, target(), 1 + 0.1 * s});
    springs.push_back({ArcPoint{s, random.uniform(0, 1)}, target(), 2});
  }
  springs.push_back({ArcPoint{0, 0}, target(), 1});
  springs.push_back({ArcPoint{1, 1}, target(), 1});
  springs.push_back({ArcPoint{2, 0.1}, target(), 1});
  return springs;
}

std::vector<JointLoad> loads() {
  return {{1, {1, -2, 0.5}, Eigen::Vector3d::Zero(), 0.7},
          {4, {0, 3, 1}, Eigen::Vector3d::Zero(), -2},
          {4, {1, 0, 0}, Eigen::Vector3d::Zero(), 0.5}};
}

Gravity gravity() { return {{0.5, -1, -9}, 0.3}; }

Conditions of(const LinkageModel& model, const std::string& kind) {
  Conditions conditions;
  if (kind != "loads" && kind != "weight") conditions.springs = springs_everywhere(model);
  if (kind != "springs" && kind != "weight") conditions.loads = loads();
  if (kind != "springs" && kind != "loads") conditions.gravity = gravity();
  conditions.validate(model);
  return conditions;
}

struct BentModel {
  BentModel() : model(build_linkage_graph(mixed_mesh()), 4, kStiffness), state(model) {
    Random random(12);
    for (int k = 0; k < 3; ++k)
      state = state.moved(model, random_increment(model.variables().size(), 0.06, random));
  }
  LinkageModel model;
  LinkageState state;
};

class ConditionTermsTest : public ::testing::TestWithParam<const char*> {};

TEST_P(ConditionTermsTest, Conform) {
  const BentModel bent;
  const Eigen::Index size = bent.model.variables().size();
  ConditionTerms terms(bent.model, of(bent.model, GetParam()));
  const Eigen::VectorXd origin = Eigen::VectorXd::Ones(size);
  EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& x) {
    return terms.potential(bent.state.moved(bent.model, x - origin)).total();
  };
  energy.gradient = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    const LinkageState moved = bent.state.moved(bent.model, x - origin);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
    terms.add_gradient(moved, gradient);
    return pulled_back(bent.model, bent.state, x - origin, moved, gradient);
  };
  // Loads on joints are linear: no Hessian to measure.
  if (GetParam() != std::string("loads")) {
    energy.hessian = [&](const Eigen::VectorXd& x) -> Eigen::MatrixXd {
      EXPECT_EQ(x, origin);
      Eigen::VectorXd gradient(size);
      CondensedMatrix matrix(bent.model.chains());
      LinkageAssembly assembly(bent.model);
      assembly.hessian(bent.state, gradient, matrix);
      const Eigen::MatrixXd before = matrix.to_sparse();
      const Eigen::VectorXd elastic = gradient;
      terms.add(bent.state, gradient, matrix);
      Eigen::VectorXd alone = Eigen::VectorXd::Zero(size);
      terms.add_gradient(bent.state, alone);
      EXPECT_LT((gradient - elastic - alone).norm(), 1e-13 * gradient.norm());
      return matrix.to_sparse() - before;
    };
  }
  limber::testing::expect_conforms(energy, origin);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ConditionTermsTest,
                         ::testing::Values("springs", "loads", "weight", "all"));

TEST(ConditionTerms, MoveWithWhatTheyActOn) {
  const BentModel bent;
  const Conditions before = of(bent.model, "all");
  const Eigen::Vector3d turn(0.7, 0.4, -1.3), shift(2, -3, 1);
  const Eigen::Matrix3d rotation = rotations::exponential(turn);
  Conditions after = before;
  for (TargetSpring& spring : after.springs) spring.position = rotation * spring.position + shift;
  for (JointLoad& load : after.loads) load.force = rotation * load.force;
  after.gravity.acceleration = rotation * before.gravity.acceleration;
  const LinkageState moved =
      bent.state.moved(bent.model, rigid_increment(bent.model, bent.state, turn, shift));
  ConditionTerms here(bent.model, before), there(bent.model, after);
  const auto e = here.potential(bent.state), f = there.potential(moved);
  EXPECT_NEAR(f.springs, e.springs, 1e-12 * e.springs);
  // Loads: the shift does the work of their resultant.
  double shifted = 0;
  for (const auto& resultant : there.resultants()) shifted -= resultant.force.dot(shift);
  EXPECT_NEAR(f.loads, e.loads + shifted, 1e-12 * e.size);
  // Forces turn along.
  Eigen::VectorXd g = Eigen::VectorXd::Zero(bent.model.variables().size()), h = g;
  here.add_gradient(bent.state, g);
  there.add_gradient(moved, h);
  const ReducedVariables& variables = bent.model.variables();
  for (int j = 0; j < variables.joints(); ++j) {
    const int at = variables.joint_begin(j);
    EXPECT_LT((h.segment<3>(at) - rotation * g.segment<3>(at)).norm(), 1e-12 * g.norm());
    EXPECT_LT((h.segment<3>(at + 3) - rotation * g.segment<3>(at + 3)).norm(), 1e-12 * g.norm());
    EXPECT_LT((h.segment<3>(at + 6) - g.segment<3>(at + 6)).norm(), 1e-12 * g.norm());
  }
}

/// Rotation of a joint's frame from one state to another [rad].
Eigen::Vector3d turn_of(const JointState<double>& from, const JointState<double>& to) {
  const auto frame = [](const JointState<double>& joint) {
    Eigen::Matrix3d m;
    m << joint.bisector, joint.normal.cross(joint.bisector), joint.normal;
    return m;
  };
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(frame(to) * frame(from).transpose()));
  return turn.angle() * turn.axis();
}

TEST(ConditionTerms, AMomentDoesItsVirtualWorkAndNothingElse) {
  const BentModel bent;
  const Eigen::Index size = bent.model.variables().size();
  Conditions conditions;
  conditions.loads = {{3, Eigen::Vector3d::Zero(), {1, -2, 0.5}, 0},
                      {4, Eigen::Vector3d::Zero(), {0.3, 0.2, 4}, 0}};
  ConditionTerms terms(bent.model, conditions);
  EXPECT_EQ(terms.potential(bent.state).total(), 0);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  terms.add_gradient(bent.state, gradient);
  Random random(8);
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd d = random_increment(size, 1, random);
    const double h = 1e-4;
    double work = 0;
    for (const double side : {h, -h}) {
      const LinkageState moved = bent.state.moved(bent.model, side * d);
      for (const JointLoad& load : conditions.loads) {
        work +=
            load.moment.dot(turn_of(bent.state.joints()[load.joint], moved.joints()[load.joint])) /
            (2 * side);
      }
    }
    EXPECT_NEAR(-gradient.dot(d), work, 1e-7 * gradient.norm() * d.norm());
    EXPECT_NEAR(terms.moment_potential(d), gradient.dot(d), 1e-13 * gradient.norm() * d.norm());
  }
  // About a joint's own axis by a known angle: work is moment times angle.
  Eigen::VectorXd step = Eigen::VectorXd::Zero(size);
  step.segment<3>(bent.model.variables().joint_begin(3) + kJointRotation) << 0, 0.25, 0;
  EXPECT_NEAR(terms.moment_potential(step), 2 * 0.25, 1e-14);
}

TEST(ConditionTerms, WeightOfAFlatGridIsThatOfItsRods) {
  // 3 x 3 joints, 12 segments of 40: rods of 480 in all, terminal edges counted once.
  const LinkageModel model = grid_model(3, 3, 1.0);
  const LinkageState drawn(model);
  Conditions conditions;
  conditions.gravity = {{0, 0, -9.81}, 0.02};
  ConditionTerms terms(model, conditions);
  const double weight = 0.02 * 9.81 * 480;
  const LinkageState lifted =
      drawn.moved(model, rigid_increment(model, drawn, Eigen::Vector3d::Zero(), {0, 0, 2.5}));
  EXPECT_NEAR(terms.potential(drawn).total(), 0, 1e-12 * weight);
  EXPECT_NEAR(terms.potential(lifted).total(), 2.5 * weight, 1e-12 * weight);
  ASSERT_EQ(terms.resultants().size(), 1U);
  EXPECT_NEAR(terms.resultants()[0].force.z(), -weight, 1e-12 * weight);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(model.variables().size());
  terms.add_gradient(drawn, gradient);
  double sum = 0;
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (int i = 0; i <= model.variables().edges(s); ++i) {
      const int at = model.variables().position(s, i);
      if (at >= 0) sum += gradient[at + 2];
    }
  }
  for (int j = 0; j < model.variables().joints(); ++j) {
    const int at = model.variables().joint_begin(j);
    sum += gradient[at + 2];
  }
  // The middle joint carries four terminal edges by half, and half of the edges after them.
  const int middle = model.variables().joint_begin(4) + 2;
  EXPECT_NEAR(gradient[middle], 0.02 * 9.81 * (4 * 4 + 4 * 4), 1e-12);
  EXPECT_NEAR(sum, weight, 1e-12 * weight);
}

TEST(ConditionTerms, ASpringPullsByStiffnessTimesDistance) {
  const LinkageModel model = grid_model(3, 3, 1.0);
  const LinkageState drawn(model);
  const Eigen::Vector3d at = drawn.joints()[4].position;
  Conditions conditions;
  conditions.springs = {{JointPoint{4}, at + Eigen::Vector3d(3, 0, -4), 2}};
  ConditionTerms terms(model, conditions);
  EXPECT_NEAR(terms.potential(drawn).springs, 25, 1e-12);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(model.variables().size());
  terms.add_gradient(drawn, gradient);
  EXPECT_LT(
      (gradient.segment<3>(model.variables().joint_begin(4)) - Eigen::Vector3d(-6, 0, 8)).norm(),
      1e-12);
  EXPECT_NEAR(gradient.norm(), 10, 1e-12);
}

}  // namespace
}  // namespace limber::rods
