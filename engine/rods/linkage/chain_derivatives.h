#pragma once

#include <array>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods::detail {

/// Point and directions of the derivatives. Pointers may be null: zero.
struct ChainPoint {
  const LinkageModel& model;
  const LinkageState& source;               // from which unknowns are counted
  const LinkageState& moved;                // the source after the increment; its twists' branches
  const double* increment;                  // variables().size() numbers
  std::array<const double*, 2> directions;  // of unknowns
  std::array<const LaneCell*, 2> rests;     // of rest lengths, a cell for each slot
  std::array<const double*, 2> sections;    // of section scales, by segment
  double share = 0;  // of the derivative along the second direction alone, added to that along both
};

/// For the four segments of a batch.
struct ChainDerivatives {
  double* numbers;  // by numbers of the chain: (4 n + 3) x lanes; those of joints are left open
  double* joints;   // by unknowns of the joints at both ends: 2 x 9 x lanes
  double* rests;    // by rest lengths of edges: n x lanes
  double* section;  // by the section's scale: lanes
};

/// The gradient of a batch's energy (order 0), or its derivative along the first direction (1) or
/// along both (2): the same kernels on numbers, duals, and duals of duals.
void evaluate_chain_derivatives(const ChainPoint& point, int batch, int order,
                                const ChainDerivatives& out);

}  // namespace limber::rods::detail
