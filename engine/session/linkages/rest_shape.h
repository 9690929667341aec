#pragma once

#include "engine/base/job.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/mapping.h"

namespace limber::session {

/// The shape that a linkage starts from: as drawn, or that of rods::solve_rest_lengths where the
/// scene asks for its lengths, which the model keeps then. Make copies of the model, and anything
/// that depends on its lengths, afterwards.
/// @throws Error{kNumerical} with field rest_lengths if no lengths are found, which would leave
/// unrequested stresses; Error{kCancelled}
[[nodiscard]] rods::LinkageState rest_shape(MappedLinkage& mapped, scene::RestLengthChoice choice,
                                            const JobContext& job);

}  // namespace limber::session
