#include "engine/beams/solver/reversal.h"

#include <cmath>
#include <utility>

#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/step_watch.h"

namespace limber::beams::detail {
namespace {

constexpr double kToleranceBack = 1e-7;             // residual
constexpr int kIterationsBack = 60;                 // of Newton's method, in one step back
constexpr double kLeastShareOfStepBack = 1.0 / 32;  // step, of the whole path back
constexpr double kShortStepBack = 1.0 / 8;          // of the whole path back
constexpr double kReturned = 0.1;                   // of the turn from one state to the other
constexpr double kSameEnergy = 1e-3;                // of an element's
constexpr double kNegligibleEnergy = 1e-6;          // of the largest of an element

/// By element: energy of stretching, negative in compression, and of bending and twist. Rotations
/// and reflections of an element do not change them.
Eigen::Matrix2Xd signed_energies(const BeamStructure& structure, const BeamState& state) {
  Eigen::Matrix2Xd result(2, structure.elements());
  for (int e = 0; e < structure.elements(); ++e) {
    const auto energies = element_energies(structure.constants(e), structure.ends(state, e));
    result.col(e) << std::copysign(energies.stretching, strain_force(structure, state, e)),
        energies.total() - energies.stretching;
  }
  return result;
}

bool have_equal_forces(const BeamStructure& structure, const BeamState& a, const BeamState& b) {
  const Eigen::Matrix2Xd of_a = signed_energies(structure, a), of_b = signed_energies(structure, b);
  const Eigen::Matrix2Xd size = of_a.cwiseAbs().cwiseMax(of_b.cwiseAbs());
  const double negligible = kNegligibleEnergy * size.maxCoeff();
  return ((of_a - of_b).cwiseAbs().array() <= kSameEnergy * size.array() + negligible).all();
}

/// Newton's method with a share of the path back at a time, less where that fails.
bool leads_back(const BeamStructure& structure, const LoadPath& path, NewtonSolver& newton,
                const PathPlace& from, const PathPlace& to, double share) {
  BeamState back = to.state;
  const double whole = to.s - from.s;
  double left = whole, step = share * whole;
  while (left > 0) {
    BeamState trial = back;
    const double next = left > step ? left - step : 0;
    const NewtonOutcome outcome =
        newton.balance(trial, path, from.s + next, kToleranceBack, kIterationsBack);
    if (outcome == NewtonOutcome::kBalanced || outcome == NewtonOutcome::kMechanism) {
      back = std::move(trial);
      left = next;
      continue;
    }
    step *= 0.5;
    if (step < kLeastShareOfStepBack * whole) return false;
  }
  const double turn = turn_between(structure, from.state, to.state).angle;
  if (turn_between(structure, from.state, back).angle < kReturned * turn) return true;
  if (carries_forces(structure, from.state)) return have_equal_forces(structure, from.state, back);
  // Without any forces, all shapes of a mechanism are equal, and stable ones are not.
  return !carries_forces(structure, back) &&
         newton.judge(from.state, path.loads(from.s)).stability ==
             NewtonSolver::Stability::kMechanism;
}

}  // namespace

bool reverses(const BeamStructure& structure, const LoadPath& path, NewtonSolver& newton,
              const PathPlace& from, const PathPlace& to) {
  // Newton's method gets neutral directions before anything is out of balance.
  (void)newton.judge(to.state, path.loads(to.s));
  // Near a limit point a long step may throw the structure to the other side.
  return leads_back(structure, path, newton, from, to, 1) ||
         leads_back(structure, path, newton, from, to, kShortStepBack);
}

}  // namespace limber::beams::detail
