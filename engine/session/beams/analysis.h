#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/results/beam_results.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/session/beams/discretisation_check.h"

namespace limber::session {

/// A structure that has been solved, with everything that is read off it.
struct BeamAnalysis {
  beams::BeamStructure structure;
  beams::BeamSolution solution;
  beams::BeamResults results;
  /// Positions of the nodes along the path, in order, 3 x nodes each [length].
  std::vector<Eigen::Matrix3Xd> shapes;
};

/// Solves a structure from the state as drawn. If a solve ends out of balance, it still returns an
/// analysis, and its report says so.
/// @param shapes  at most so many along the path, >= 0; every second one is dropped whenever there
/// are more, so that they stay evenly spread
/// @throws Error as beams::validate and BeamSolveOptions::validate; {kCancelled}
[[nodiscard]] BeamAnalysis analyse(beams::BeamModel model, const beams::BeamSolveOptions& options,
                                   int shapes = 0, const JobContext& job = {});

/// How far an answer is from the limit of ever shorter elements. There is no tolerance.
/// @param analysis  converged
/// @throws Error{kCancelled}
[[nodiscard]] DiscretisationCheck check_discretisation(const BeamAnalysis& analysis,
                                                       const JobContext& job = {});

}  // namespace limber::session
