#pragma once

#include <string>

#include "engine/base/job.h"
#include "engine/rods/design/linkage_design.h"
#include "engine/rods/equilibrium/conditions.h"

namespace limber::session {

/// Says so where what is to lie flat rises much as the deployed shape does: over the plane nearest
/// to its joints by more than a hundredth of the linkage's size, and a quarter of what that rises.
/// @param length_scale  the linkage's size [length]
[[nodiscard]] std::string describe_flatness(const rods::LinkageModel& model,
                                            const rods::DesignPoint& point, double length_scale);

/// A flat linkage of bent rods has several equilibria, and a design follows one: releases what
/// holds its deployed shape, step by step (rods::deploy), and checks whether it reaches that one.
/// @param model           with the sizes of the point
/// @param flat, deployed  what holds its shapes
/// @returns what to tell; empty where it falls to the flat shape, or the caller cancels
[[nodiscard]] std::string describe_release(const rods::LinkageModel& model,
                                           const rods::Conditions& flat,
                                           const rods::Conditions& deployed,
                                           const rods::DesignPoint& point, const JobContext& job);

/// Says so where a shape that is flat, held at a mean angle, rises by more than a hundredth of the
/// linkage's size when all of its angles are released.
/// @param flat  what holds the flat shape; where that is no mean angle, nothing is reported
[[nodiscard]] std::string describe_springing_up(const rods::LinkageModel& model,
                                                const rods::Conditions& flat,
                                                const rods::DesignPoint& point, double length_scale,
                                                const JobContext& job);

/// Says so where the deployed shape lies in a plane: by symmetry nothing that is varied brings it
/// out of that.
[[nodiscard]] std::string describe_plane(const rods::LinkageModel& model,
                                         const rods::DesignPoint& point, double length_scale);

}  // namespace limber::session
