#pragma once

#include "engine/beams/solver/beam_solution.h"
#include "tests/support/charted_structure.h"

namespace limber::testing {

/// Settings of the public code's jobs.
struct ChartedOptions {
  double mass_factor = 1;  // gamma
  double slower = 0.9969;  // xi: what the time step, 1 at first, is multiplied with at a peak
  /// Step from which it is. Peaks while motions are brought on slowly would leave nothing of it.
  int slower_from = 0;
  /// Steps during which temporary loads are on, and over which motions are brought on.
  int temporary_until = 1000;
  int motion_from = 1000, motion_until = 1500;
  /// Balance: sum over nodes of the norm of what is out of balance on their six unknowns [force].
  double residual = 1e-3;
  /// At rest: kinetic energy of translations after a peak [force length].
  double rest_energy = 1e-15;
  int steps = 1000000;
};

struct ChartedResult {
  /// kConverged, kStalled (at rest out of balance, which the public code calls converged),
  /// kUnstable, kIterationLimit. A balance is not tested for being a saddle.
  beams::BeamStatus status = beams::BeamStatus::kIterationLimit;
  ChartedUnknowns unknowns;  // always finite: the last ones that were
  int steps = 0, peaks = 0;
  double residual = 0;  // as in the options
};

/// Dynamic relaxation as the paper's public code does it, written plainly: semi-implicit Euler
/// with masses from stiffnesses of the present lengths; where the kinetic energy has passed a
/// maximum the last step is taken back, all start again from rest, and the time step shrinks.
/// Baseline of the benchmark.
[[nodiscard]] ChartedResult relax_charted(const ChartedStructure& structure,
                                          const ChartedOptions& options = {});

}  // namespace limber::testing
