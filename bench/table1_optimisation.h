#pragma once

#include <optional>

#include "bench/recovery_scenes.h"
#include "bench/spacetime_problems.h"

namespace limber::bench {

/// Cost and result of an optimisation of a row of table 1. Times are medians.
struct Optimised {
  int outer_iterations = 0;     // accepted joint steps
  int inner_iterations = 0;     // evaluations of u and J, and steps of the cold z
  double seconds = 0;           // z cold, then the material until its energy has settled
  bool converged = false;       // not stopped by the limit of steps
  double energy = 0;            // total
  double force_energy = 0;      // with columns of S of unit norm
  double constraint_error = 0;  // positions: largest miss, body lengths; keyframes: relative
  double z_only_seconds = 0, z_only_force_energy = 0;  // of the cold z; recoveries: 0
  /// The paper's alternation of 30 rounds, and until ours is where it ended (below 0: never).
  std::optional<double> literal_seconds, literal_energy, seconds_to_literal;
};

/// Whether the paper's alternation is run too.
enum class Baseline { kNone, kLiteral };

/// z, Lambda, D and S of position constraints (spacetime::MaterialSolver with its defaults).
[[nodiscard]] Optimised optimise_positions(const SpacetimeProblem& problem, Baseline baseline,
                                           int repeats);

/// z, Lambda, D and S of a motion that keyframes hold in every frame (spacetime::recover, gamma =
/// 1, mu = 1e-8). Its steps evaluate no u and no J: inner_iterations are steps too.
/// @param model  of a body with the scene's mesh and fixed nodes
[[nodiscard]] Optimised optimise_recovery(const RecoveryScene& scene,
                                          const reduced::ReducedModel& model, int modes,
                                          int repeats);

}  // namespace limber::bench
