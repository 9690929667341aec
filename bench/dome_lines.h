#pragma once

#include "engine/rods/linkage/line_mesh.h"

namespace limber::bench {

/// A flat grid of rods [m] whose cells are longer in its middle, as the sample `dome`: it leaves
/// its plane where it is opened.
/// @param rods  in each direction, >= 3: rods^2 joints but for corners
[[nodiscard]] rods::LineMesh dome_lines(int rods);

}  // namespace limber::bench
