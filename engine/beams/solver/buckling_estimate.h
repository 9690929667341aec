#pragma once

#include <optional>
#include <string>

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/solver/load_path.h"

namespace limber::beams::detail {

/// Linear buckling of the start of a load path: forces in proportion to a small share of the path.
struct BucklingEstimate {
  double load_share = 0;  // of loads and motions, at which the stiffness ceases to be positive
  int unknown = -1;       // that moves most
  /// The element with the largest compression at all loads: -N L^2 / EI. -1 where motions of nodes
  /// compress: their forces do not grow any further once the structure buckles.
  int element = -1;
  double compression = 0;
};

/// Above this compression of an element (that of a cantilever of its length at its buckling load)
/// the structure may have no equilibrium that its beams would have.
inline constexpr double kMaxResolvedCompression = 2.5;

/// @returns nothing where loads are on at the start, where nothing is compressed, or where the
/// first share of the loads does not balance
[[nodiscard]] std::optional<BucklingEstimate> estimate_buckling(const BeamStructure& structure,
                                                                const BeamState& start,
                                                                const LoadPath& path,
                                                                const JobContext& context);

/// Appends to the message of a solve that found no equilibrium at which share of the loads the
/// structure buckles, and a remedy.
void explain_failure(const BeamStructure& structure, const BeamState& start, const LoadPath& path,
                     const JobContext& context, BeamReport& report);

}  // namespace limber::beams::detail
