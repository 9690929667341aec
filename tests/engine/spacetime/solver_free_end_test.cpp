#include <gtest/gtest.h>

#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/scenes.h"
#include "tests/support/literal_spacetime.h"

namespace limber::spacetime {
namespace {

using testing::LinearKinematics;

/// NOTATION.md: a mode that grows by more than 4 behind a free end's last knot is held at zero in
/// the end's last frames. For anything held, the reported energy must be that of the motion handed
/// out. (Exact answers on the trimmed time line: 24.98033113 free first, 29.95891944 free last.)
TEST(FreeEnd, EnergyOfAnExplosiveModeIsThatOfTheMotion) {
  const auto kinematics = std::make_shared<LinearKinematics>(3, 3, 1.0, 29);
  ModeDynamics dynamics = test_dynamics(3, 15, 0.0);
  dynamics.stiffness << 1e-4, 1.0, 1e3;
  const auto constraints = linear_constraints(*kinematics, 5, 18, 100, 30);
  for (const Timeline timeline :
       {Timeline{18, EndCondition::kFree, EndCondition::kPinnedPosition},
        Timeline{18, EndCondition::kPinnedPosition, EndCondition::kFree}}) {
    Solver solver(kinematics, dynamics, timeline);
    for (const auto& constraint : constraints) solver.add(constraint);
    const SolveReport report = solver.solve();
    testing::LiteralSpacetime literal(kinematics, dynamics, timeline, constraints);
    EXPECT_NEAR(report.total_energy,
                literal.force_energy(solver.motion()) + literal.constraint_energy(solver.motion()),
                1e-6 * report.total_energy);
  }
}

}  // namespace
}  // namespace limber::spacetime
