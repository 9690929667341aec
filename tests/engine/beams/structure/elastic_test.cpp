#include "engine/beams/structure/elastic.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/beams/structure/node_loads.h"
#include "tests/support/beam_problems.h"
#include "tests/support/energy_conformance.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;

/// A bent frame with every kind of release, a cable, local axes and a curved element.
BeamModel frame() {
  BeamModel model;
  model.sections.push_back({40, 0.7, 1.3, 0.4});
  for (const Vector3d& p : {Vector3d(0, 0, 0), Vector3d(1, 0.1, 0), Vector3d(1.8, 0.6, 0.3),
                            Vector3d(2.1, 1.5, 0.2), Vector3d(1, 1, 1)})
    model.nodes.push_back({p, Vector3d(0.1, -0.2, 1)});
  for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {3, 2}, {1, 4}, {4, 3}}) {
    BeamElement e;
    e.start = a;
    e.finish = b;
    model.elements.push_back(e);
  }
  model.elements[1].start_release.rotations = {false, true, false};
  model.elements[2].finish_release.rotations = {true, false, true};
  model.elements[2].start_release.rotations = {false, true, true};
  model.elements[3].finish_release.rotations = {true, true, true};
  model.elements[3].start_release.forces[2] = true;
  model.elements[0].rest_curvature = Vector3d(0.2, -0.3, 0.1);
  model.elements[4].kind = BeamKind::kCable;
  model.elements[4].rest_length = 0.6;
  BeamSupport support;
  support.fixed = {true, false, true, true, false, false};
  support.axes = rotations::exponential({0.3, -0.4, 0.9});
  model.supports.push_back(support);
  // Where elements are released, and about one axis alone as at node 0.
  support.node = 2;
  support.fixed = {false, false, true, false, false, true};
  support.axes = rotations::exponential({-0.8, 0.1, 0.5});
  model.supports.push_back(support);
  return model;
}

Eigen::VectorXd random_increments(const BeamStructure& structure, std::uint64_t seed) {
  Random random(seed);
  Eigen::VectorXd x(structure.unknowns());
  for (double& entry : x) entry = random.uniform(-0.2, 0.2);
  return x;
}

/// Compares derivatives with differences of the potential of elastic energy and loads over
/// elements.
void expect_derivatives(const BeamModel& model) {
  const BeamStructure structure(model);
  const NodeLoads loads = NodeLoads::of(model);
  const BeamState from =
      structure.moved(structure.moved(structure.rest_state(), random_increments(structure, 1)),
                      random_increments(structure, 2));
  const auto n = structure.unknowns();
  const auto value = [&](const Eigen::VectorXd& x) {
    const BeamState at = structure.moved(from, x);
    double potential = elastic_energies(structure, at).total();
    for (int e = 0; e < structure.elements(); ++e)
      potential += spread_potential(load_transfer(structure, e), structure.ends(at, e),
                                    loads.element_forces.col(e));
    return potential;
  };
  const Eigen::VectorXd gradient =
      elastic_gradient(structure, from) - load_vector(structure, loads, from);
  // Second differences of the value along the increments: the Hessian of what moved() does.
  Stiffness stiffness(structure);
  stiffness.assemble(from, loads);
  const Eigen::MatrixXd lower(stiffness.matrix());
  const double h = 2e-4;
  const auto unit = [n](int i) { return Eigen::VectorXd(Eigen::VectorXd::Unit(n, i)); };
  double gradient_error = 0, hessian_error = 0, scale = 0;
  const std::vector<int>& free = stiffness.free_unknowns();
  for (int i = 0; i < n; ++i) {
    const double e = 1e-6;
    gradient_error =
        std::max(gradient_error,
                 std::abs((value(e * unit(i)) - value(-e * unit(i))) / (2 * e) - gradient[i]));
  }
  for (std::size_t i = 0; i < free.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const Eigen::VectorXd p = h * unit(free[i]), q = h * unit(free[j]);
      const double second =
          (value(p + q) - value(p - q) - value(q - p) + value(-p - q)) / (4 * h * h);
      const double entry = lower(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      hessian_error = std::max(hessian_error, std::abs(second - entry));
      scale = std::max(scale, std::abs(entry));
    }
  }
  EXPECT_LT(gradient_error, 1e-7 * gradient.norm());
  EXPECT_LT(hessian_error, 3e-6 * scale);
  EXPECT_GT(scale, 1);
}

TEST(BeamStructure, DerivativesWithReleasesAndLocalAxes) { expect_derivatives(frame()); }

TEST(BeamStructure, DerivativesWithLoadsOverElements) {
  BeamModel model = frame();
  for (int e = 0; e < 5; ++e)
    model.distributed_loads.push_back({e, {30.0 - 20 * e, 25.0, 10.0 * e - 40}});
  expect_derivatives(model);
  model.elements[1].finish_release.forces = {true, false, false};
  model.elements[0].start_release.forces = {false, true, false};
  expect_derivatives(model);
}

TEST(BeamStructure, StiffnessFromHeldUnknownsIsThatOfTheWhole) {
  BeamModel model = frame();
  model.supports[0].fixed[4] = true;
  const BeamStructure structure(model);
  model.supports[0].fixed = {true, false, false, false, false, false};
  const BeamStructure freer(model);
  const BeamState state = structure.moved(structure.rest_state(), random_increments(structure, 3));
  Stiffness stiffness(structure), whole(freer);
  stiffness.assemble(state);
  whole.assemble(state);
  const Eigen::VectorXd increments = random_increments(structure, 4);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(structure.unknowns());
  for (const int u : {2, 3}) all[u] = increments[u];  // held here, free there
  const Eigen::VectorXd expected = whole.extended(whole.times(whole.restricted(all)));
  const Eigen::VectorXd got = stiffness.extended(stiffness.from_held(all));
  for (const int u : stiffness.free_unknowns()) EXPECT_NEAR(got[u], expected[u], 1e-11);
  EXPECT_GT(got.norm(), 0.1);
}

TEST(BeamStructure, NothingIsStressedAsDrawn) {
  BeamModel model = frame();
  model.elements[0].rest_curvature.setZero();
  model.elements[4].rest_length = 0;
  const BeamStructure structure(model);
  EXPECT_LT(elastic_energies(structure, structure.rest_state()).total(), 1e-28);
  EXPECT_LT(elastic_gradient(structure, structure.rest_state()).norm(), 1e-13);
}

TEST(BeamStructure, RotationsThatNoBeamFeelsAreHeld) {
  BeamModel model = frame();
  const BeamStructure structure(model);
  // Node 4 has a ball joint and a cable.
  for (int k = 3; k < 6; ++k) EXPECT_EQ(structure.held()[24 + k], 1);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(structure.held()[24 + k], 0);
  EXPECT_EQ(structure.unknowns(), 30 + 1 + 2 + 2 + 3);
}

TEST(BeamLoads, FollowingLoadsTurnWithTheirNode) {
  BeamModel model = limber::testing::straight_beam(2);
  model.supports.push_back(limber::testing::clamped(0));
  model.loads.push_back({2, {0, 0, 3}, {1, 0, 0}, LoadDirection::kFollowing});
  model.loads.push_back({2, {0, 0, 5}});
  model.distributed_loads.push_back({1, {0, 4, 0}, LoadDirection::kFollowing});
  const BeamStructure structure(model);
  BeamState state = structure.rest_state();
  state.rotations[2] = rotation_by({0, 1.57079632679489661923, 0});
  const Eigen::VectorXd load = load_vector(structure, NodeLoads::of(model), state);
  EXPECT_LT((load.segment<3>(12) - Vector3d(3, 1, 5)).norm(), 1e-14);
  // The moment of the node, and that of the load over the element, whose end points down.
  EXPECT_LT((load.segment<3>(15) - Vector3d(-1.0 / 12, 0, -1)).norm(), 1e-14);
  EXPECT_LT((load.segment<3>(6) - Vector3d(0, 1, 0)).norm(), 1e-14);
}

}  // namespace
}  // namespace limber::beams
