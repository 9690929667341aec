#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "engine/beams/refinement/discretisation_error.h"
#include "engine/beams/results/beam_results.h"

namespace limber::beams::detail {

/// Powers of the parts' length by which differences are taken to fall.
inline constexpr double kLeastOrder = 2, kLargestOrder = 4;
/// Remainder of differences that fall by such a power, over the last of them.
[[nodiscard]] inline double rest_of(double order) { return 1 / (std::exp2(order) - 1); }

/// Bending moments and utilisations of a structure's elements, at places that are the same for
/// every cut.
struct SampledForces {
  std::vector<Eigen::Matrix2Xd> moments;  // per element: about axes 2 and 3, by columns
  std::vector<double> utilisations;       // the largest of each
  double moment_scale = 0;                // that errors are compared with [force length]
};

/// @param model  the structure, not cut
/// @param results  of its elements, whatever they were cut into
/// @param places  cut whose parts hold eight intervals each
[[nodiscard]] SampledForces sample_forces(const BeamModel& model, const BeamResults& results,
                                          const Subdivision& places);

/// Sets errors of moments and utilisations by Richardson's extrapolation.
/// @param coarse, halves, quarters  equilibria of parts, of their halves, of their quarters
void set_force_errors(const SampledForces& coarse, const SampledForces& halves,
                      const SampledForces* quarters, DiscretisationError& error);

/// For each element of the structure: energy of the difference between its forces and those of its
/// halves, the root [sqrt(force length)]; 0 for cables.
/// @param results, halves  of its elements
[[nodiscard]] std::vector<double> difference_energies(const BeamModel& model,
                                                      const Subdivision& subdivision,
                                                      const BeamResults& results,
                                                      const BeamResults& halves);

}  // namespace limber::beams::detail
