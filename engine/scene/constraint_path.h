#pragma once

#include <Eigen/Core>

#include "engine/scene/scene.h"

namespace limber::scene {

/// Frames that one path may have.
inline constexpr int kMaxPathFrames = 2000;
inline constexpr double kGreatestReach = 1e6;  // [s]

/// Target of a constraint in one of its frames. Between the keys of a path each axis is a monotone
/// piecewise cubic (Fritsch and Carlson 1980, with the slopes of Brodlie). It has continuous
/// velocity and no overshoot, and rests where two keys are the same. At the ends the slope is that
/// of the outermost piece times 1 - ease.
/// @param frame  in [constraint.frame, constraint.last_frame()]
[[nodiscard]] Eigen::Vector3d target_in(const Constraint& constraint, int frame);

/// The same path elsewhere: its first key at `target`.
void move_path(Constraint& constraint, const Eigen::Vector3d& target);

/// Keys in frames of the scene, each later than the one before, at most kMaxPathFrames; finite
/// targets; ease in [0, 1]; no velocity. Of all constraints the reach.
/// @throws Error{kInvalidArgument, kOutOfRange} naming the field in the constraint
void check_path(const Constraint& constraint, int frame_count);

}  // namespace limber::scene
