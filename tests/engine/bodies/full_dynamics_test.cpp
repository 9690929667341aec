#include "engine/bodies/full_dynamics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/bodies/stiffness.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bodies {
namespace {

using testing::Hold;
using testing::slender_beam;
using Status = StepReport::Status;

Eigen::VectorXd gravity(const FullDynamics& dynamics, const Eigen::Vector3d& g) {
  const auto nodes = dynamics.mass().rows() / 3;
  return dynamics.mass() * g.replicate(nodes, 1);
}

/// v = w x (X + u - c).
DynamicState spinning(const ElasticBody& body, const Eigen::Vector3d& turn) {
  DynamicState state;
  state.displacement = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  state.velocity = state.displacement;
  const Eigen::Vector3d centre = body.mesh.nodes.rowwise().mean();
  for (int a = 0; a < body.mesh.node_count(); ++a)
    state.velocity.segment<3>(3 * a) = turn.cross(body.mesh.nodes.col(a) - centre);
  return state;
}

struct Momenta {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();
};

Momenta momenta(const ElasticBody& body, const FullDynamics& dynamics) {
  Momenta sum;
  const Eigen::VectorXd p = dynamics.mass() * dynamics.state().velocity;
  for (int a = 0; a < body.mesh.node_count(); ++a) {
    const Eigen::Vector3d x =
        body.mesh.nodes.col(a) + dynamics.state().displacement.segment<3>(3 * a);
    sum.linear += p.segment<3>(3 * a);
    sum.angular += x.cross(Eigen::Vector3d(p.segment<3>(3 * a)));
  }
  return sum;
}

/// Largest relative departure of the energy from where it was, over a second of a spinning,
/// stretching free body.
double energy_band(TimeStepping scheme, double time_step) {
  const ElasticBody body = slender_beam(Hold::kFree);
  DynamicsOptions options;
  options.scheme = scheme;
  options.time_step = time_step;
  FullDynamics dynamics(body, options);
  dynamics.set_state(spinning(body, {2, 12, 5}));
  const double first = dynamics.kinetic_energy();
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  double band = 0;
  for (int i = 0; i < std::lround(0.5 / time_step); ++i) {
    EXPECT_EQ(dynamics.step(none).status, Status::kConverged);
    band = std::max(band, std::abs(dynamics.kinetic_energy() + dynamics.elastic_energy() - first));
  }
  return band / first;
}

TEST(FullDynamics, FallsAsGalileoSays) {
  const ElasticBody body = slender_beam(Hold::kFree);
  FullDynamics dynamics(body, {});
  const Eigen::VectorXd weight = gravity(dynamics, {0, 0, -9.81});
  for (int i = 0; i < 120; ++i) ASSERT_EQ(dynamics.step(weight).status, Status::kConverged);
  for (int a = 0; a < body.mesh.node_count(); ++a) {
    EXPECT_NEAR(dynamics.state().displacement[3 * a + 2], -9.81 / 2 * 0.25, 1e-9);
    EXPECT_NEAR(dynamics.state().velocity[3 * a + 2], -9.81 * 0.5, 1e-8);
  }
}

TEST(FullDynamics, MidpointKeepsMomentaOfASpinningBody) {
  const ElasticBody body = slender_beam(Hold::kFree);
  FullDynamics dynamics(body, {});
  DynamicState state = spinning(body, {2, 12, 5});
  for (int a = 0; a < body.mesh.node_count(); ++a) state.velocity[3 * a] += 0.5;
  dynamics.set_state(state);
  const Momenta before = momenta(body, dynamics);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  for (int i = 0; i < 240; ++i) ASSERT_EQ(dynamics.step(none).status, Status::kConverged);
  const Momenta after = momenta(body, dynamics);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-9 * before.angular.norm());
}

TEST(FullDynamics, MidpointKeepsEnergyInABandOfSecondOrder) {
  const double coarse = energy_band(TimeStepping::kImplicitMidpoint, 1.0 / 240);
  const double fine = energy_band(TimeStepping::kImplicitMidpoint, 1.0 / 480);
  EXPECT_LT(coarse, 0.02);
  EXPECT_LT(fine, 0.35 * coarse);
}

TEST(FullDynamics, EulerOnlyLosesEnergy) {
  const ElasticBody body = slender_beam(Hold::kFree);
  DynamicsOptions options;
  options.scheme = TimeStepping::kImplicitEuler;
  FullDynamics dynamics(body, options);
  dynamics.set_state(spinning(body, {2, 12, 5}));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  double energy = dynamics.kinetic_energy();
  const double first = energy;
  for (int i = 0; i < 240; ++i) {
    ASSERT_EQ(dynamics.step(none).status, Status::kConverged);
    const double now = dynamics.kinetic_energy() + dynamics.elastic_energy();
    EXPECT_LE(now, energy * (1 + 1e-10));
    energy = now;
  }
  EXPECT_LT(energy, 0.98 * first);
}

TEST(FullDynamics, SmallSwingsHaveTheFrequencyOfTheMode) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  const ModalBasis modes = modal_analysis(body, ModalOptions{});
  const double omega = std::sqrt(modes.eigenvalues[0]);
  const double period = 2 * std::numbers::pi / omega;
  DynamicsOptions options;
  options.time_step = period / 400;
  options.tolerance = 1e-10;
  FullDynamics dynamics(body, options);
  const Eigen::VectorXd shape = modes.modes.col(0) / modes.modes.col(0).lpNorm<Eigen::Infinity>();
  dynamics.set_state({1e-6 * shape, Eigen::VectorXd::Zero(shape.size())});
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(shape.size());
  for (int i = 0; i < 400; ++i) ASSERT_EQ(dynamics.step(none).status, Status::kConverged);
  // After one period it is back; the midpoint rule is late by omega^2 h^2 / 12 of a period.
  const double h = omega * options.time_step;
  const double late = 2 * std::numbers::pi * h * h / 12;
  const Eigen::VectorXd expected = 1e-6 * std::cos(late) * shape;
  EXPECT_LT((dynamics.state().displacement - expected).norm(), 2e-5 * expected.norm());
}

TEST(FullDynamics, ComesToRestInStaticEquilibrium) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  DynamicsOptions options;
  options.scheme = TimeStepping::kImplicitEuler;
  options.mass_damping = 5;
  options.time_step = 0.05;
  FullDynamics dynamics(body, options);
  const Eigen::VectorXd weight = gravity(dynamics, {0, 0, -9.81});
  for (int i = 0; i < 400; ++i) ASSERT_EQ(dynamics.step(weight).status, Status::kConverged);
  Eigen::VectorXd left = dynamics.elasticity().gradient(dynamics.state().displacement) - weight;
  for (const int node : body.fixed_nodes) left.segment<3>(3 * node).setZero();
  EXPECT_LT(left.norm(), 1e-7 * weight.norm());
  EXPECT_LT(dynamics.state().displacement.minCoeff(), -0.02);  // and it does sag
}

TEST(FullDynamics, DampingOfTheStrainLetsRigidMotionsGo) {
  const ElasticBody body = slender_beam(Hold::kFree, {1e9, 0.3, 1000});
  DynamicsOptions options;
  options.relaxation_time = 0.01;
  FullDynamics dynamics(body, options);
  DynamicState state = spinning(body, {0, 3, 0});
  dynamics.set_state(state);
  const double first = dynamics.kinetic_energy();
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  for (int i = 0; i < 240; ++i) ASSERT_EQ(dynamics.step(none).status, Status::kConverged);
  EXPECT_NEAR(dynamics.kinetic_energy() / first, 1, 1e-3);
  // A soft one that rings comes to a rest of its strain: what is left is its turn.
  const ElasticBody soft = slender_beam(Hold::kFree);
  options.relaxation_time = 0.05;
  FullDynamics ringing(soft, options);
  state = {Eigen::VectorXd::Zero(none.size()), Eigen::VectorXd::Zero(none.size())};
  for (int a = 0; a < soft.mesh.node_count(); ++a)
    state.displacement[3 * a] = 0.1 * (soft.mesh.nodes(0, a) - 0.3);
  ringing.set_state(state);
  const double stored = ringing.elastic_energy();
  for (int i = 0; i < 240; ++i) ASSERT_EQ(ringing.step(none).status, Status::kConverged);
  EXPECT_LT(ringing.elastic_energy() + ringing.kinetic_energy(), 1e-3 * stored);
}

TEST(FullDynamics, AStepThatDoesNotConvergeChangesNothing) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  DynamicsOptions options;
  options.max_newton_steps = 1;
  options.tolerance = 1e-12;
  options.time_step = 1;
  FullDynamics dynamics(body, options);
  const Eigen::VectorXd weight = gravity(dynamics, {0, 0, -50});
  EXPECT_EQ(dynamics.step(weight).status, Status::kNotConverged);
  EXPECT_TRUE(dynamics.state().displacement.isZero(0));
  EXPECT_TRUE(dynamics.state().velocity.isZero(0));
}

TEST(FullDynamics, RefusesWhatIsNoStateAndNoOption) {
  const ElasticBody body = slender_beam(Hold::kLeftFace);
  FullDynamics dynamics(body, {});
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(3 * body.mesh.node_count());
  Eigen::VectorXd moved = zero;
  moved[3 * body.fixed_nodes[0]] = 1;
  const auto field_of = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const Error& error) {
      return error.field();
    }
    return "accepted";
  };
  EXPECT_EQ(field_of([&] { dynamics.set_state({zero.head(5), zero}); }), "displacement");
  EXPECT_EQ(field_of([&] { dynamics.set_state({zero, zero * NAN}); }), "velocity");
  EXPECT_EQ(field_of([&] { dynamics.set_state({zero, moved}); }), "velocity");
  DynamicsOptions options;
  options.time_step = 0;
  EXPECT_EQ(field_of([&] { FullDynamics(body, options); }), "time_step");
  options = {};
  options.relaxation_time = NAN;
  EXPECT_EQ(field_of([&] { FullDynamics(body, options); }), "relaxation_time");
}

}  // namespace
}  // namespace limber::bodies
