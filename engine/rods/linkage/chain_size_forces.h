#pragma once

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/rod/length_weights.h"
#include "engine/rods/solver/lanes.h"

namespace limber::rods::detail {

/// How a batch's gradient changes with its sizes.
/// @param slots, parameters  of the batch, see LinkageState::slots, LinkageModel::slot_parameters
/// @param rests     changes of the edges' rest lengths, by slot
/// @param growth    relative changes of the sections' scales: lanes
/// @param gradient  by numbers of the chain: (4 n + 3) x lanes, overwritten
void evaluate_chain_size_forces(int edges, const double* slots, const double* parameters,
                                const RodStiffness& stiffness, BendingForm form,
                                const LaneCell* rests, const double* growth, double* gradient);

}  // namespace limber::rods::detail
