#include "engine/spacetime/solver.h"

#include <gtest/gtest.h>

#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/literal_spacetime.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LiteralSpacetime;

class EveryEnd : public ::testing::TestWithParam<Ends> {};

TEST_P(EveryEnd, AgreesWithTheLiteralMethod) {
  const auto kinematics = std::make_shared<ChainKinematics>(9, 8, 1.0, 2.0, 3);
  // Stiffness below 4: a free end does not explode, the optimum is within double precision.
  ModeDynamics dynamics = test_dynamics(9, 40, 0.01);
  const Timeline timeline{60, GetParam().first, GetParam().last};
  const auto constraints = test_constraints(*kinematics, 6, timeline, 0.5, 100, 5);
  Solver solver(kinematics, dynamics, timeline);
  for (const auto& constraint : constraints) solver.add(constraint);
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message << " " << report.gradient;

  LiteralSpacetime literal(kinematics, dynamics, timeline, constraints);
  // From there the literal method, which iterates all frames at once, finds nothing lower ...
  const auto further = literal.solve_from(solver.motion());
  EXPECT_NEAR(report.total_energy, further.total_energy, 1e-9 * further.total_energy);
  // ... and led along the same path from z = 0 it ends nowhere better. (With free ends its
  // Gauss-Newton converges too slowly to be held to more.)
  const auto reference = literal.solve_continued();
  EXPECT_LE(report.total_energy, (1 + 1e-6) * reference.total_energy);
  // The energies of the report are those of the motion that is handed out.
  EXPECT_NEAR(report.force_energy, literal.force_energy(solver.motion()),
              1e-9 * report.total_energy);
  EXPECT_NEAR(report.constraint_energy, literal.constraint_energy(solver.motion()),
              1e-9 * report.total_energy);
}

INSTANTIATE_TEST_SUITE_P(All, EveryEnd, ::testing::ValuesIn(open_ends()),
                         ::testing::PrintToStringParamName());

}  // namespace
}  // namespace limber::spacetime
