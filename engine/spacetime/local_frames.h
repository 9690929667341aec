#pragma once

#include <vector>

#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// In which frames constraints with a reach may change the motion: true in the windows around those
/// that they read. Empty where no constraint has a reach.
[[nodiscard]] std::vector<bool> local_frames(const ConstraintSet& constraints,
                                             const Timeline& timeline);

/// Frames outside the windows of which one is no more than `width` frames away: with these held, a
/// window has no effect beyond them. Those that ends hold are left out.
/// @param width  frames of a force row, less one
[[nodiscard]] std::vector<int> border_frames(const std::vector<bool>& local,
                                             const Timeline& timeline, int width);

}  // namespace limber::spacetime
