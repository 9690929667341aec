#pragma once

#include "engine/base/job.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/scene/linkage.h"
#include "engine/session/linkages/mapping.h"

namespace limber::session {

/// The shape that a linkage starts from: as drawn, or that of rods::solve_rest_lengths where the
/// scene asks for its lengths, which the model keeps then. So all that copies the model or depends
/// on its lengths is made afterwards.
/// @throws Error{kNumerical} with field rest_lengths where no lengths are found, which would leave
/// stresses that nobody asked for; Error{kCancelled}
[[nodiscard]] rods::LinkageState rest_shape(MappedLinkage& mapped, scene::RestLengthChoice choice,
                                            const JobContext& job);

}  // namespace limber::session
