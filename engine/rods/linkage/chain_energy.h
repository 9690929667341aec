#pragma once

#include "engine/rods/linkage/compression.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/solver/chain_batches.h"

namespace limber::rods::detail {

/// Outputs for the four segments of a batch; null pointers leave out.
struct ChainOutputs {
  double* energies = nullptr;  // stretching, bending, twisting: 3 x lanes
  double* gradient = nullptr;  // by number of the chain: (4 n + 3) x lanes, overwritten
  double* band = nullptr;      // CondensedMatrix::band, overwritten
  Compression compression = Compression::kBuckles;
  /// Tensions of the edges, n x lanes, that gradient and band use in place of the actual ones.
  const double* tensions = nullptr;
};

/// @param slots  of the state; @param parameters  of the model
void evaluate_chains(const ChainBatch& batch, const double* slots, const double* parameters,
                     const RodStiffness& stiffness, BendingForm form, const ChainOutputs& out);

}  // namespace limber::rods::detail
