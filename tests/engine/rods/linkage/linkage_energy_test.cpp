#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/rods/rod/rod_state.h"
#include "tests/engine/rods/linkage/differences.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"
#include "tests/engine/rods/linkage/state_charts.h"

namespace limber::rods {
namespace {

using testing::derivative;
using testing::kStiffness;
using testing::mixed_mesh;
using testing::random_increment;

class LinkageEnergyTest : public ::testing::TestWithParam<BendingForm> {
 protected:
  LinkageEnergyTest()
      : model_(build_linkage_graph(mixed_mesh()), 6, kStiffness, GetParam()),
        assembly_(model_),
        state_(model_) {
    Random random(1);
    for (int k = 0; k < 3; ++k)  // bent, twisted and turned
      state_ = state_.moved(model_, random_increment(size(), 0.06, random));
  }
  [[nodiscard]] Eigen::Index size() const { return model_.variables().size(); }

  LinkageModel model_;
  LinkageAssembly assembly_;
  LinkageState state_;
};

TEST_P(LinkageEnergyTest, GradientAgreesWithDifferences) {
  Eigen::VectorXd gradient(size());
  const double energy = assembly_.gradient(state_, gradient).total();
  EXPECT_EQ(energy, assembly_.energies(state_).total());
  EXPECT_NEAR(assembly_.segment_energies().sum(), energy, 1e-12 * energy);
  for (Eigen::Index i = 0; i < size(); ++i) {
    const double difference = derivative(
        [&](double h) {
          return assembly_.energies(state_.moved(model_, h * Eigen::VectorXd::Unit(size(), i)))
              .total();
        },
        1e-3);
    EXPECT_NEAR(difference, gradient[i], 1e-7 * gradient.norm()) << "unknown " << i;
  }
}

TEST_P(LinkageEnergyTest, HessianAgreesWithDifferencesOfTheEnergy) {
  Eigen::VectorXd gradient(size());
  CondensedMatrix matrix(model_.chains());
  const double energy = assembly_.hessian(state_, gradient, matrix).total();
  Eigen::VectorXd alone(size());
  EXPECT_EQ(assembly_.gradient(state_, alone).total(), energy);
  EXPECT_EQ(alone, gradient);
  const Eigen::MatrixXd hessian = matrix.to_sparse();
  EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-12 * hessian.norm());
  Random random(2);
  for (int k = 0; k < 40; ++k) {
    const Eigen::VectorXd d = random_increment(size(), 1, random);
    const auto energy_along = [&](double h) {
      return assembly_.energies(state_.moved(model_, h * d)).total();
    };
    const double h = 2e-4;
    const double second = (16 * (energy_along(h) + energy_along(-h)) - energy_along(2 * h) -
                           energy_along(-2 * h) - 30 * energy_along(0)) /
                          (12 * h * h);
    EXPECT_NEAR(second, d.dot(hessian * d), 1e-6 * std::abs(second));
  }
  // Single pairs, joints with themselves and with their segments above all.
  const int joints = model_.variables().joint_begin(0);
  for (int k = 0; k < 300; ++k) {
    const auto i = static_cast<Eigen::Index>(k < 200 ? joints + random.index(size() - joints)
                                                     : random.index(size()));
    const auto j = static_cast<Eigen::Index>(k < 100 ? joints + random.index(size() - joints)
                                                     : random.index(size()));
    if (k >= 20 && hessian(i, j) == 0) continue;
    const double h = 3e-3;
    const double difference = derivative(
        [&](double a) {
          return derivative(
              [&](double b) {
                Eigen::VectorXd step = Eigen::VectorXd::Zero(size());
                step[i] += a;
                step[j] += b;
                return assembly_.energies(state_.moved(model_, step)).total();
              },
              h);
        },
        h);
    EXPECT_NEAR(difference, hessian(i, j), 2e-6 * hessian.cwiseAbs().maxCoeff()) << i << " " << j;
  }
}

TEST_P(LinkageEnergyTest, NothingOfAnEarlierHessianStays) {
  Random random(8);
  const LinkageState elsewhere = state_.moved(model_, random_increment(size(), 0.3, random));
  Eigen::VectorXd gradient(size());
  CondensedMatrix fresh(model_.chains()), used(model_.chains());
  (void)assembly_.hessian(state_, gradient, fresh);
  (void)assembly_.hessian(elsewhere, gradient, used);
  (void)assembly_.hessian(state_, gradient, used);
  const Eigen::VectorXd x = random_increment(size(), 1, random);
  Eigen::VectorXd expected(size()), found(size());
  fresh.multiply(x, expected);
  used.multiply(x, found);
  EXPECT_EQ(found, expected);
}

TEST_P(LinkageEnergyTest, RigidMotionCostsNothing) {
  Eigen::VectorXd gradient(size());
  CondensedMatrix matrix(model_.chains());
  const double energy = assembly_.hessian(state_, gradient, matrix).total();
  const Eigen::Vector3d axis(0.3, -0.4, 0.5), shift(1, 2, -1);
  Eigen::VectorXd motion = Eigen::VectorXd::Zero(size());
  const ReducedVariables& variables = model_.variables();
  for (int s = 0; s < variables.segments(); ++s) {
    for (int i = 0; i <= variables.edges(s); ++i) {
      const int at = variables.position(s, i);
      if (at >= 0) motion.segment<3>(at) = shift + axis.cross(state_.vertex(model_, s, i));
      if (i == variables.edges(s) || variables.angle(s, i) < 0) continue;
      const Eigen::Vector3d edge = state_.vertex(model_, s, i + 1) - state_.vertex(model_, s, i);
      motion[variables.angle(s, i)] = axis.dot(edge.normalized());
    }
  }
  for (int j = 0; j < variables.joints(); ++j) {
    motion.segment<3>(variables.joint_begin(j)) = shift + axis.cross(state_.joints()[j].position);
    motion.segment<3>(variables.joint_begin(j) + 3) = axis;
  }
  EXPECT_NEAR(gradient.dot(motion), 0, 1e-12 * gradient.norm() * motion.norm());
  EXPECT_GT(energy, 1e-2);
}

INSTANTIATE_TEST_SUITE_P(BothForms, LinkageEnergyTest,
                         ::testing::Values(BendingForm::kMaterialFrames,
                                           BendingForm::kAveragedFrames));

TEST(LinkageEnergy, OfALoneRodIsTheRods) {
  LineMesh mesh;
  mesh.vertices.resize(3, 2);
  mesh.vertices << 0, 1, 0, 0.5, 0, 0.2;
  mesh.edges.resize(2, 1);
  mesh.edges << 0, 1;
  const LinkageModel model(build_linkage_graph(mesh), 5, kStiffness);
  Random random(3);
  const LinkageState drawn(model);
  const Eigen::VectorXd x = random_increment(model.variables().size(), 0.1, random);
  const LinkageState state = drawn.moved(model, x);
  LinkageAssembly assembly(model);

  const auto layout = std::make_shared<const RodLayout>(std::vector<int>{5});
  Eigen::VectorXd unknowns = Eigen::VectorXd::Zero(layout->unknowns());
  Eigen::Matrix3Xd directors = Eigen::Matrix3Xd::Zero(3, layout->nodes());
  for (int i = 0; i <= 5; ++i) {
    unknowns.segment<3>(4 * i) = state.vertex(model, 0, i);
    if (i < 5) directors.col(i) = state.director(model, 0, i);
  }
  RodParameters parameters(*layout);
  for (int slot = 0; slot < layout->nodes(); ++slot) {
    parameters(slot, RodParameters::kRestLength) = model.rest_lengths().free_edge[0];
    parameters(slot, RodParameters::kStretching) = kStiffness.stretching;
    parameters(slot, RodParameters::kBending1) = kStiffness.bending_1;
    parameters(slot, RodParameters::kBending2) = kStiffness.bending_2;
    parameters(slot, RodParameters::kTorsion) = kStiffness.torsion;
  }
  const auto source = std::make_shared<const SourceFrames>(
      SourceFrames::from_directors(*layout, unknowns, directors));
  const RodState rod(layout, source, unknowns);
  const RodEnergies expected = rod.energies(parameters);
  const RodEnergies energies = assembly.energies(state);
  EXPECT_NEAR(energies.stretching, expected.stretching, 1e-12);
  EXPECT_NEAR(energies.bending, expected.bending, 1e-12);
  EXPECT_NEAR(energies.twisting, expected.twisting, 1e-12);
  EXPECT_GT(energies.twisting, 1e-4);
}

TEST(LinkageEnergy, StraightLinkagesStoreNothing) {
  const LinkageModel model(build_linkage_graph(testing::sheared_grid(4, 3, 0.7)), 7, kStiffness);
  LinkageAssembly assembly(model);
  EXPECT_LT(assembly.energies(LinkageState(model)).total(), 1e-24);
  EXPECT_THROW(LinkageModel(model.graph(), 7, {1, 1, 0, 1}), Error);
  EXPECT_THROW(LinkageModel(model.graph(), 2, kStiffness), Error);
}

TEST(LinkageEnergy, ResultsDoNotDependOnThreads) {
  const LinkageModel model(build_linkage_graph(testing::sheared_grid(9, 9, 0.7)), 10, kStiffness);
  const int before = thread_count();
  std::vector<Eigen::VectorXd> gradients;
  std::vector<double> energies;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    Random random(4);
    LinkageAssembly assembly(model);
    const LinkageState state =
        LinkageState(model).moved(model, random_increment(model.variables().size(), 0.02, random));
    Eigen::VectorXd gradient(model.variables().size());
    CondensedMatrix matrix(model.chains());
    energies.push_back(assembly.hessian(state, gradient, matrix).total());
    Eigen::VectorXd product(gradient.size());
    matrix.multiply(gradient, product);
    gradients.push_back(gradient + product);
  }
  set_thread_count(before);
  EXPECT_EQ(energies[0], energies[1]);
  EXPECT_EQ(gradients[0], gradients[1]);
}

}  // namespace
}  // namespace limber::rods
