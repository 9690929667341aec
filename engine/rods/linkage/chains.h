#pragma once

#include <memory>

#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/rods/solver/chain_batches.h"

namespace limber::rods {

/// A linkage's segments as the solver's chains: the same unknowns in the same order.
[[nodiscard]] std::shared_ptr<const ChainBatches> chains_of(const LinkageGraph& graph,
                                                            const ReducedVariables& variables);

}  // namespace limber::rods
