#include "engine/beams/results/beam_results.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/beams/structure/node_loads.h"
#include "tests/support/beam_problems.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;
using limber::testing::cantilever_model;
using limber::testing::clamped;
using limber::testing::straight_beam;

BeamState solved(const BeamStructure& structure) {
  const BeamSolution found = find_equilibrium(structure);
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  return found.state;
}

TEST(BeamResults, ReactionsOfACantileverFarFromStraight) {
  const BeamStructure structure(cantilever_model(20, 10));
  const BeamState state = solved(structure);
  const BeamResults results = results_of(structure, state);
  EXPECT_LT((results.reaction_forces.col(0) - Vector3d(0, 0, -10)).norm(), 1e-6);
  // The arm is where the tip has gone.
  EXPECT_LT((results.reaction_moments.col(0) - Vector3d(0, 10 * state.positions(0, 20), 0)).norm(),
            1e-6);
  EXPECT_LT(results.reaction_forces.rightCols(20).norm(), 1e-30);
  EXPECT_NEAR(results.energies.total(), elastic_energies(structure, state).total(), 1e-12);
}

TEST(BeamResults, ReactionsBalanceLoadsOfAllKinds) {
  BeamModel model = straight_beam(8, 2, 50);
  model.sections[0].mass_per_length = 0.3;
  model.gravity = Vector3d(0, 0, -2);
  model.supports = {clamped(0), {8, {false, true, true, false, false, false}}};
  model.loads.push_back({4, {0.1, -0.3, 0.2}, {0, 0.1, 0.2}});
  for (int e = 0; e < 8; ++e)
    model.distributed_loads.push_back({e, {0, 0.2, 0}, LoadDirection::kFollowing});
  const BeamStructure structure(model);
  const BeamState state = solved(structure);
  const BeamResults results = results_of(structure, state);
  const Eigen::VectorXd load = load_vector(structure, NodeLoads::of(model), state);
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
  for (int i = 0; i < structure.nodes(); ++i) {
    const Vector3d f = load.segment<3>(6 * i) + results.reaction_forces.col(i);
    force += f;
    moment += load.segment<3>(6 * i + 3) + results.reaction_moments.col(i) +
              Vector3d(state.positions.col(i)).cross(f);
  }
  EXPECT_GT(results.reaction_forces.norm(), 0.5);
  EXPECT_LT(force.norm(), 1e-7);
  EXPECT_LT(moment.norm(), 1e-7);
}

TEST(BeamResults, SignsAndSizesOfElementForces) {
  // Small load: N, V and M of the textbook.
  BeamModel model = straight_beam(4, 1, 100);
  model.supports.push_back(clamped(0));
  const double p = 1e-3, q = 2e-3, n = 5e-3, t = 7e-4;
  model.loads.push_back({4, {n, q, p}, {t, 0, 0}});
  const BeamStructure structure(model);
  const BeamResults results = results_of(structure, solved(structure));
  for (int e = 0; e < 4; ++e) {
    const ElementForces& f = results.forces[static_cast<std::size_t>(e)];
    EXPECT_NEAR(f.axial, n, 1e-5);
    EXPECT_NEAR(f.torque, t, 1e-5);
    EXPECT_NEAR(f.shear_3, p, 1e-5);
    EXPECT_NEAR(f.shear_2, q, 1e-5);
    EXPECT_NEAR(std::abs(f.start_moment_2), p * (1 - 0.25 * e), 2e-5);
    EXPECT_NEAR(std::abs(f.finish_moment_3), q * (0.75 - 0.25 * e), 2e-5);
    // Moments are continuous from element to element.
    if (e > 0) {
      const ElementForces& before = results.forces[static_cast<std::size_t>(e - 1)];
      EXPECT_NEAR(before.finish_moment_2, f.start_moment_2, 1e-5);
      EXPECT_NEAR(before.finish_moment_3, f.start_moment_3, 1e-5);
    }
  }
}

TEST(BeamResults, StressesAndUtilisation) {
  BeamModel model = straight_beam(4, 1);
  model.sections[0] = make_section(rectangle(0.01, 0.02), {2e11, 0.3, 7850, 2.5e8});
  model.supports.push_back(clamped(0));
  model.loads.push_back({4, {0, 0, 30}});
  const BeamStructure structure(model);
  const BeamResults results = results_of(structure, solved(structure));
  // M / W = 30 / (b h^2 / 6).
  const double expected = 30 / (0.01 * 0.02 * 0.02 / 6);
  EXPECT_NEAR(results.stresses[0].bending, expected, 1e-3 * expected);
  EXPECT_NEAR(results.largest_utilisation, expected / 2.5e8, 2e-3);
  EXPECT_NEAR(results.stresses[0].torsion, 0, 1e-12);
  EXPECT_LT(results.largest_bend, 0.02);
}

TEST(BeamReleases, AHingeInTheMiddle) {
  // Each half is a cantilever: P L^3 / (48 EI) in the middle.
  BeamModel model = straight_beam(8, 1, 1000);
  model.supports = {clamped(0), clamped(8)};
  model.elements[4].start_release.rotations = {false, true, false};
  const double load = 1e-3;
  model.loads.push_back({4, {0, 0, load}});
  const BeamStructure structure(model);
  const BeamState state = solved(structure);
  EXPECT_NEAR(state.positions(2, 4), load / 48, 1e-5 * load);  // (P/2) (L/2)^3 / (3 EI)
  const BeamResults results = results_of(structure, state);
  EXPECT_NEAR(results.forces[4].start_moment_2, 0, 1e-9);
  EXPECT_NEAR(results.forces[3].finish_moment_2, 0, 1e-9);
  EXPECT_GT(std::abs(results.forces[0].start_moment_2), 0.2 * load);
}

TEST(BeamReleases, AHingeTurnsByAnyAngle) {
  // A beam on a hinge, pulled to the other side: it comes to lie along the force.
  for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation}) {
    BeamModel model = straight_beam(4, 1, 100);
    model.supports.push_back(clamped(0));
    model.elements[0].start_release.rotations = {false, true, false};
    model.loads.push_back({4, {-0.5, 0, 0.05}});
    BeamSolveOptions options;
    options.method = method;
    const BeamSolution found = find_equilibrium(BeamStructure(model), options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const Vector3d direction = found.state.positions.col(4).normalized();
    EXPECT_LT((direction - Vector3d(-0.5, 0, 0.05).normalized()).norm(), 1e-5);
    EXPECT_LT(found.state.rotations[0].vec().norm(), 1e-12);
  }
}

TEST(BeamReleases, SlidesPassNoForce) {
  BeamModel model = straight_beam(4, 1, 100);
  model.supports = {clamped(0), clamped(4)};
  model.elements[2].start_release.forces = {true, false, false};
  model.loads.push_back({3, {0.01, 0, 0}});
  const BeamStructure axial(model);
  EXPECT_NEAR(results_of(axial, solved(axial)).forces[2].axial, 0, 1e-12);
  model.elements[2].start_release.forces = {false, false, true};
  // Small, since the section's axes turn, and with them the axial force.
  model.loads[0].force = Vector3d(0, 0, 0.001);
  const BeamStructure shear(model);
  const BeamResults results = results_of(shear, solved(shear));
  EXPECT_NEAR(results.forces[2].shear_3, 0, 1e-8);
  EXPECT_GT(std::abs(results.forces[3].shear_3), 5e-4);
}

TEST(BeamCables, PullAndGoSlack) {
  // A mast with two stays: the one towards the load is slack.
  BeamModel model = straight_beam(4, 1, 100);
  for (int i = 0; i <= 4; ++i)
    model.nodes[static_cast<std::size_t>(i)] = {Vector3d(0, 0, 0.25 * i), Vector3d(1, 0, 0)};
  model.nodes.push_back({Vector3d(1, 0, 0)});
  model.nodes.push_back({Vector3d(-1, 0, 0)});
  for (const int foot : {5, 6}) {
    BeamElement stay;
    stay.start = foot;
    stay.finish = 4;
    stay.kind = BeamKind::kCable;
    model.elements.push_back(stay);
    model.supports.push_back({foot, {true, true, true, false, false, false}});
  }
  model.supports.push_back(clamped(0));
  model.loads.push_back({4, {2, 0, 0}});
  for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation}) {
    BeamSolveOptions options;
    options.method = method;
    const BeamStructure structure(model);
    const BeamSolution found = find_equilibrium(structure, options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const BeamResults results = results_of(structure, found.state);
    EXPECT_EQ(results.forces[4].axial, 0);
    EXPECT_GT(results.forces[5].axial, 2);
    EXPECT_LT(found.state.positions(0, 4), 0.01);
  }
}

TEST(BeamSupports, AnInclinedRollerPushesAcrossItsDirection) {
  BeamModel model = straight_beam(6, 1, 200);
  model.supports.push_back(clamped(0));
  BeamSupport roller;
  roller.node = 6;
  roller.fixed = {false, false, true, false, false, false};
  const double c = std::sqrt(0.5);
  roller.axes << c, 0, -c, 0, 1, 0, c, 0, c;  // rolls along (1, 0, 1)
  model.supports.push_back(roller);
  model.loads.push_back({3, {0, 0, -1}});
  for (const BeamMethod method : {BeamMethod::kNewton, BeamMethod::kRelaxation}) {
    BeamSolveOptions options;
    options.method = method;
    const BeamStructure structure(model);
    const BeamSolution found = find_equilibrium(structure, options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const Vector3d move = found.state.positions.col(6) - Vector3d(1, 0, 0);
    EXPECT_NEAR(move.dot(roller.axes.col(2)), 0, 1e-12);
    const Vector3d reaction = results_of(structure, found.state).reaction_forces.col(6);
    EXPECT_GT(reaction.norm(), 0.1);
    EXPECT_LT(reaction.cross(Vector3d(roller.axes.col(2))).norm(), 1e-9);
  }
}

TEST(BeamLoads, WeightOfACantilever) {
  BeamModel model = straight_beam(20, 1, 1000);
  model.sections[0].mass_per_length = 0.01;
  model.gravity = Vector3d(0, 0, -2);
  model.supports.push_back(clamped(0));
  const BeamStructure structure(model);
  const double expected = 0.02 / 8;  // q L^4 / (8 EI)
  EXPECT_NEAR(-solved(structure).positions(2, 20), expected, 3e-3 * expected);
}

}  // namespace
}  // namespace limber::beams
