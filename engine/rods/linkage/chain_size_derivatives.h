#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods::detail {

/// For the four segments of a batch.
struct ChainSizeDerivatives {
  double* rests;    // by rest lengths of edges: n x lanes
  double* section;  // by the section's scale: lanes
};

/// share * dE/dL + d/dx (dE/dL) v of a batch's energy E, see SizeDerivatives.
/// @param v  change of the unknowns, variables().size() numbers; null: zero
void evaluate_chain_sizes(const LinkageModel& model, const LinkageState& state, double share,
                          const double* v, int batch, const ChainSizeDerivatives& out);

}  // namespace limber::rods::detail
