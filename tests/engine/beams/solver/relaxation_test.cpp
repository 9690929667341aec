#include "engine/beams/solver/relaxation.h"

#include <gtest/gtest.h>

#include "engine/beams/structure/elastic.h"
#include "tests/support/beam_problems.h"

namespace limber::beams::detail {
namespace {

/// A closed ring with spokes, hinges and a cable, out of its plane: 17 elements, so that the last
/// batch is not full.
BeamModel wheel() {
  BeamModel model;
  model.sections.push_back({400, 0.8, 1, 2});
  model.nodes.push_back({Eigen::Vector3d(0, 0, 0.3)});
  for (int i = 0; i < 8; ++i) {
    const double phi = 0.78539816339744831 * i;
    model.nodes.push_back({Eigen::Vector3d(std::cos(phi), std::sin(phi), 0.02 * i)});
  }
  for (int i = 0; i < 8; ++i) {
    for (const auto& [a, b] : {std::pair{1 + i, 1 + (i + 1) % 8}, {0, 1 + i}}) {
      BeamElement e;
      e.start = a;
      e.finish = b;
      model.elements.push_back(e);
    }
  }
  model.elements[3].start_release.rotations = {false, true, false};
  model.elements[5].finish_release.rotations = {true, true, true};
  model.elements[8].finish_release.rotations = {false, true, true};
  BeamElement cable;
  cable.start = 1;
  cable.finish = 5;
  cable.kind = BeamKind::kCable;
  cable.rest_length = 1.9;
  model.elements.push_back(cable);
  model.supports.push_back(limber::testing::clamped(1));
  model.loads.push_back({0, {0.2, -0.1, 0.8}, {0.1, 0.2, 0.3}});
  return model;
}

TEST(Relaxation, ManyElementsAtOnceAreTheSameAsOneByOne) {
  const BeamStructure structure(wheel());
  const BeamState start = structure.rest_state();
  Relaxation vector(structure, start), plain(structure, start, ElementKernel::kPlain);
  for (Relaxation* relaxation : {&vector, &plain}) {
    relaxation->set_loads(NodeLoads::of(structure.model()));
    for (int i = 0; i < 100; ++i) relaxation->step();
  }
  EXPECT_GT((vector.state().positions - start.positions).norm(), 1e-3);
  EXPECT_LT((vector.state().positions - plain.state().positions).norm(), 1e-12);
}

TEST(Relaxation, ItsResidualIsThatOfTheEnergy) {
  const BeamStructure structure(wheel());
  Relaxation relaxation(structure, structure.rest_state());
  const NodeLoads loads = NodeLoads::of(structure.model());
  relaxation.set_loads(loads);
  for (int i = 0; i < 40; ++i) relaxation.step();
  const BeamState state = relaxation.state();
  relaxation.step();  // looks at `state` before it moves on
  const Eigen::VectorXd expected =
      load_vector(structure, loads, state) - elastic_gradient(structure, state);
  const Eigen::VectorXd got = relaxation.residual().unbalanced;
  EXPECT_GT(expected.norm(), 1e-3);
  EXPECT_LT((got - expected).norm(), 1e-10 * (1 + expected.norm()));
}

TEST(Relaxation, KineticEnergyIsWhatForcesGave) {
  // Energy is kept until the first peak: what the potential loses the masses gain.
  const BeamStructure structure(limber::testing::cantilever_model(10, 0.1, 1, 50));
  Relaxation relaxation(structure, structure.rest_state());
  const NodeLoads loads = NodeLoads::of(structure.model());
  relaxation.set_loads(loads);
  const BeamState start = structure.rest_state();
  for (int i = 0; i < 30; ++i) relaxation.step();
  ASSERT_EQ(relaxation.peaks(), 0);
  const BeamState state = relaxation.state();
  const double work = loads.forces.cwiseProduct(state.positions - start.positions).sum();
  const double gained = work - elastic_energies(structure, state).total();
  EXPECT_GT(gained, 0);
  EXPECT_NEAR(relaxation.kinetic_energy(), gained, 0.15 * gained);
}

TEST(Relaxation, AndNewtonAgreeOnAStructureWithEverything) {
  BeamSolveOptions options;
  options.method = BeamMethod::kRelaxation;
  options.relaxation_tolerance = 1e-9;
  const BeamStructure structure(wheel());
  const BeamSolution relaxed = find_equilibrium(structure, options);
  options.method = BeamMethod::kNewton;
  const BeamSolution newton = find_equilibrium(structure, options);
  ASSERT_TRUE(relaxed.report.converged()) << relaxed.report.message;
  ASSERT_TRUE(newton.report.converged()) << newton.report.message;
  EXPECT_LT((relaxed.state.positions - newton.state.positions).norm(), 1e-6);
}

}  // namespace
}  // namespace limber::beams::detail
