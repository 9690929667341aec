#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_derivatives.h"
#include "engine/rods/linkage/linkage_model.h"

namespace limber::rods::detail {

/// Does a direction change rest lengths, of segments or of edges?
[[nodiscard]] bool moves_rests(const LinkageVector& direction);

/// Change of each edge's rest length by a direction.
/// @param rests  by slot, resized; of empty lanes zero
void spread_rests(const LinkageModel& model, const LinkageVector& direction,
                  std::vector<LaneCell>& rests);

}  // namespace limber::rods::detail
