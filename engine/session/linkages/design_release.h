#pragma once

#include <string>

#include "engine/base/job.h"
#include "engine/rods/design/linkage_design.h"
#include "engine/rods/equilibrium/conditions.h"

namespace limber::session {

/// Reports a flat shape that rises much in its deployed state. Its joints rise over their nearest
/// plane by more than a hundredth of the linkage's size, and by a quarter of the deployed rise.
/// @param length_scale  the linkage's size [length]
[[nodiscard]] std::string describe_flatness(const rods::LinkageModel& model,
                                            const rods::DesignPoint& point, double length_scale);

/// A flat linkage of bent rods has several equilibria, and a design follows one. Releases the
/// supports of its deployed shape step by step (rods::deploy) and checks whether it reaches that
/// one.
/// @param model           with the sizes of the point
/// @param flat, deployed  conditions that hold its shapes
/// @returns what to tell; empty where it falls to the flat shape, or the caller cancels
[[nodiscard]] std::string describe_release(const rods::LinkageModel& model,
                                           const rods::Conditions& flat,
                                           const rods::Conditions& deployed,
                                           const rods::DesignPoint& point, const JobContext& job);

/// Says so where a shape that is flat, held at a mean angle, rises by more than a hundredth of the
/// linkage's size when all of its angles are released.
/// @param flat  conditions that hold the flat shape; without a mean angle, nothing is reported
[[nodiscard]] std::string describe_springing_up(const rods::LinkageModel& model,
                                                const rods::Conditions& flat,
                                                const rods::DesignPoint& point, double length_scale,
                                                const JobContext& job);

/// Reports a deployed shape that is plane: by symmetry no variable moves it out of its plane.
[[nodiscard]] std::string describe_plane(const rods::LinkageModel& model,
                                         const rods::DesignPoint& point, double length_scale);

}  // namespace limber::session
